//! Scatter and gather sweeps: kinematics, inverse and forward dynamics, mass matrix, momentum.
