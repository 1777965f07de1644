/* Small dense matrices, stored column by column. */

#ifndef HFSA_MATRIX_H
#define HFSA_MATRIX_H

void hfsa_multiply(int n, const double* a, const double* b, double* product);
void hfsa_add_product(int n, const double* a, const double* x, double* y);
double hfsa_norm(int n, const double* a);
void hfsa_balance(int n, double* a, double* scale);
int hfsa_factorize(int n, double* a, int* pivot);
void hfsa_solve(int n, const double* factors, const int* pivot, double* x);
int hfsa_phi(int n, const double* a, double h, double* phi, double* scratch);

#endif
