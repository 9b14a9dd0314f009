//! Integrators over flat state vectors.
