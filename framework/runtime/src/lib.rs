//! Models, ports, wires, plan, clock, state, checkpoints.
