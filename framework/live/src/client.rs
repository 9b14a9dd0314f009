//! The client of the socket.
use crate::protocol::{
    FrameError, LONGEST_REPLY, LONGEST_REQUEST, Reply, ReplyKind, Request, RequestKind, VERSION,
    read_frame, write_frame,
};
use serde::{Deserialize, Serialize};
use std::net::TcpStream;
use std::path::Path;

/// Address and token of a run: live.json in its folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ticket {
    /// Version of the protocol.
    pub version: u32,
    /// `127.0.0.1:43210`.
    pub address: String,
    /// The token.
    pub token: String,
}

impl Ticket {
    /// Name of the file in the folder of a run.
    pub const FILE: &str = "live.json";

    /// Writes the file. If the system supports it, only this user can read it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        // Write to a temporary name first, because the file of a killed run may have other
        // permissions.
        let fresh = path.with_extension("json.new");
        match std::fs::remove_file(&fresh) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(e),
            _ => {}
        }
        let mut options = std::fs::File::options();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        serde_json::to_writer(options.open(&fresh)?, self)?;
        std::fs::rename(&fresh, path)
    }

    /// Reads the file.
    ///
    /// # Errors
    /// The file cannot be read, or is not a ticket.
    pub fn read(path: &Path) -> std::io::Result<Ticket> {
        use std::io::Read;
        // Check before opening: opening a pipe would block, and a ticket must be short.
        if !path.metadata()?.is_file() {
            return Err(std::io::Error::other("it is not a regular file"));
        }
        let mut bytes = Vec::new();
        std::fs::File::open(path)?.take(1 << 16).read_to_end(&mut bytes)?;
        serde_json::from_slice(&bytes).map_err(std::io::Error::from)
    }
}

/// The run cannot be reached, or rejects the request.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The connection failed.
    #[error("the run: {0}\n  help: it has ended, or another program uses its address")]
    Frame(FrameError),
    /// The request exceeds the largest length.
    #[error("{0}\n  help: request fewer variables at once, with narrower patterns")]
    Long(FrameError),
    /// The run rejected the request.
    #[error("{message}\n  help: {help}")]
    Refused {
        /// The reason.
        message: String,
        /// The remedy.
        help: String,
    },
}

/// A connection to a run.
pub struct Client {
    socket: TcpStream,
    last: u64,
}

impl From<FrameError> for ClientError {
    fn from(e: FrameError) -> Self {
        match e {
            FrameError::Long { .. } => ClientError::Long(e),
            e => ClientError::Frame(e),
        }
    }
}

impl Client {
    /// Connects and sends hello.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn connect(ticket: &Ticket) -> Result<Client, ClientError> {
        let socket = TcpStream::connect(&ticket.address).map_err(FrameError::from)?;
        socket.set_nodelay(true).map_err(FrameError::from)?;
        let mut client = Client { socket, last: 0 };
        client.ask(RequestKind::Hello { version: VERSION, token: ticket.token.clone() })?;
        Ok(client)
    }

    /// Sends a request and returns its number.
    ///
    /// # Errors
    /// [`ClientError::Frame`].
    pub fn send(&mut self, ask: RequestKind) -> Result<u64, ClientError> {
        self.last += 1;
        let request = Request { id: self.last, ask };
        write_frame(&mut self.socket, &request, LONGEST_REQUEST)?;
        Ok(self.last)
    }

    /// Receives the next reply to any request.
    ///
    /// # Errors
    /// [`ClientError::Frame`].
    pub fn receive(&mut self) -> Result<Reply, ClientError> {
        Ok(read_frame(&mut self.socket, LONGEST_REPLY)?)
    }

    /// Sends a request and waits for the answer. Samples of a watch that arrive before are skipped.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn ask(&mut self, ask: RequestKind) -> Result<ReplyKind, ClientError> {
        let id = self.send(ask)?;
        loop {
            let reply = self.receive()?;
            // A rejection that does not refer to a request concerns the connection.
            match reply.said {
                ReplyKind::Refused { message, help } if reply.id == id || reply.id == 0 => {
                    return Err(ClientError::Refused { message, help });
                }
                said if reply.id == id => return Ok(said),
                _ => {}
            }
        }
    }
}
