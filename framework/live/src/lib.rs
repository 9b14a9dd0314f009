//! A socket on a run under way: watch, read and set variables, pause, step, checkpoint.
//!
//! Messages are typed and carry no code (`framework/live/PROTOCOL.md`). Threads of the server read and
//! write sockets; the run itself attends to requests between two ticks, so that a client that
//! stalls, floods or sends garbage costs it nothing but the rows that are not taken.
//!
//! | module | what it holds |
//! |---|---|
//! | `protocol` | messages, and frames of them |
//! | `server` | who may speak: sockets, the token, queues |
//! | `attend` | what is done between two ticks |
//! | `client` | the other side, for `linkwork attach` and tests |
mod attend;
mod client;
mod protocol;
mod server;

pub use attend::Live;
pub use client::{Client, ClientError, Ticket};
pub use protocol::{
    Amount, Ask, FrameError, LONGEST_REPLY, LONGEST_REQUEST, Reply, Request, Said, VERSION,
    read_frame, write_frame,
};
pub use server::{ServeError, Server};
