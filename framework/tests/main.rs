//! The examples, run and held to their right answers.
mod examples;
