"""The actions that a cycle of the master is made of: exchange, step, extrapolate, iterate, feed back, solve, record."""
