//! A socket through which clients watch, read and set variables of a running simulation, pause it, step it, and save checkpoints.
//!
//! Messages are typed and do not contain code (`framework/live/PROTOCOL.md`). Threads of the server read and write sockets. The run processes
//! requests only between two ticks, so a client that stalls, floods or sends garbage affects only its own samples.
//!
//! | module | content |
//! |---|---|
//! | `protocol` | messages, and their frames |
//! | `server` | sockets, authentication by the token, queues |
//! | `attend` | processing of requests between two ticks |
//! | `client` | the client, for `linkwork attach` and tests |
mod attend;
mod client;
mod protocol;
mod server;

pub use attend::Live;
pub use client::{Client, ClientError, Ticket};
pub use protocol::{
    Amount, FrameError, LONGEST_REPLY, LONGEST_REQUEST, Reply, ReplyKind, Request, RequestKind,
    VERSION, read_frame, write_frame,
};
pub use server::{ServeError, Server};
