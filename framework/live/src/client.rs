//! The client's side of the socket.
use crate::protocol::{
    Ask, FrameError, LONGEST_REPLY, LONGEST_REQUEST, Reply, Request, Said, VERSION, read_frame,
    write_frame,
};
use serde::{Deserialize, Serialize};
use std::net::TcpStream;
use std::path::Path;

/// Where a run listens and what it wants to hear: live.json in its folder.
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
    /// Its file in the folder of a run.
    pub const FILE: &str = "live.json";

    /// Writes it, for this user's eyes only where the system knows users.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        // Under another name until it is whole. One of a run that was killed may have other rights.
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

    /// Reads it.
    ///
    /// # Errors
    /// The file cannot be read, or is none.
    pub fn read(path: &Path) -> std::io::Result<Ticket> {
        use std::io::Read;
        // A pipe would be waited for, and a ticket is short.
        if !path.metadata()?.is_file() {
            return Err(std::io::Error::other("it is no file"));
        }
        let mut bytes = Vec::new();
        std::fs::File::open(path)?.take(1 << 16).read_to_end(&mut bytes)?;
        serde_json::from_slice(&bytes).map_err(std::io::Error::from)
    }
}

/// The run cannot be reached, or will not.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The connection failed.
    #[error("the run: {0}\n  help: it has ended, or another program is at its address")]
    Frame(FrameError),
    /// The request is longer than any may be.
    #[error("{0}\n  help: ask for fewer variables at once, by narrower patterns")]
    Long(FrameError),
    /// The run says no.
    #[error("{message}\n  help: {help}")]
    Refused {
        /// Why.
        message: String,
        /// What to do about it.
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
    /// Connects and says hello.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn connect(ticket: &Ticket) -> Result<Client, ClientError> {
        let socket = TcpStream::connect(&ticket.address).map_err(FrameError::from)?;
        socket.set_nodelay(true).map_err(FrameError::from)?;
        let mut client = Client { socket, last: 0 };
        client.ask(Ask::Hello { version: VERSION, token: ticket.token.clone() })?;
        Ok(client)
    }

    /// Sends a request; gives its number.
    ///
    /// # Errors
    /// [`ClientError::Frame`].
    pub fn send(&mut self, ask: Ask) -> Result<u64, ClientError> {
        self.last += 1;
        let request = Request { id: self.last, ask };
        write_frame(&mut self.socket, &request, LONGEST_REQUEST)?;
        Ok(self.last)
    }

    /// The next reply, to whatever it is.
    ///
    /// # Errors
    /// [`ClientError::Frame`].
    pub fn receive(&mut self) -> Result<Reply, ClientError> {
        Ok(read_frame(&mut self.socket, LONGEST_REPLY)?)
    }

    /// Asks, and waits for the answer; rows of a watch that come before are passed over.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn ask(&mut self, ask: Ask) -> Result<Said, ClientError> {
        let id = self.send(ask)?;
        loop {
            let reply = self.receive()?;
            // A refusal without a number is about the connection.
            match reply.said {
                Said::Refused { message, help } if reply.id == id || reply.id == 0 => {
                    return Err(ClientError::Refused { message, help });
                }
                said if reply.id == id => return Ok(said),
                _ => {}
            }
        }
    }
}
