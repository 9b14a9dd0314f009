//! Derive macros: #[model], Ports, Params, State.
