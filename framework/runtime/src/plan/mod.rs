//! Everything about a simulation that does not change while it runs: specification, plan, program, conditions.
pub mod balance;
pub(crate) mod compiled;
pub(crate) mod condition;
pub(crate) mod identity;
pub(crate) mod program;
pub(crate) mod route;
pub(crate) mod spec;
