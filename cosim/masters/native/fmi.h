/* How functions of FMUs are called, in FMI 2 and FMI 3. */

#ifndef FMI_H
#define FMI_H

#include "call.h"

/* What is differentiated by, and along which direction: `detail` of a directional derivative. */
typedef struct {
  const unsigned* references;
  size_t n;
  const double* seed;
} Knowns;

/* Get and set (alike); set derivatives of inputs, whose orders are the `detail`; differentiate; step. */
EXPORT Perform hfsa_values_2, hfsa_values_3;
EXPORT Perform hfsa_input_derivatives_2;
EXPORT Perform hfsa_directional_2, hfsa_directional_3;
EXPORT Perform hfsa_step_2, hfsa_step_3;

/* Keep the state and bring it back: `detail` is where the pointer to it is. */
EXPORT Perform hfsa_save, hfsa_restore;

#endif
