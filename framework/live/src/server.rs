//! Sockets, authentication by the token, and queues between the socket threads and the run.
//!
//! ```text
//! accept ── one thread for each client: hello, then requests ──(16)──► the run
//!                        writer of the client ◄──(64)── replies and samples
//! ```
//! Both queues are bounded, that of replies in number and in bytes. A full queue of requests blocks that client's reader. A full queue of replies
//! loses samples, which are counted; if an answer does not fit, the connection ends.
use crate::protocol::{
    FrameError, LONGEST_REPLY, LONGEST_REQUEST, Reply, ReplyKind, Request, RequestKind, VERSION,
    frame, read_frame, write_frame,
};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{
    Receiver, Sender, SyncSender, TryRecvError, TrySendError, channel, sync_channel,
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Largest number of queued requests and replies of one client.
const REQUESTS: usize = 16;
const REPLIES: usize = 64;
/// Largest number of clients at a time.
const CLIENTS: usize = 16;
/// Largest number of connections before their hello. A further connection closes the oldest of them, so that silent connections do not block clients.
const STRANGERS: usize = 64;
/// Largest size of the first message, bytes.
const LONGEST_HELLO: usize = 1024;
/// Time limit for the hello of a client, and for each write to it.
const PATIENCE: Duration = Duration::from_secs(5);

/// The socket cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is not valid, or is in use.
    #[error(
        "--serve `{address}`: {source}\n  help: give HOST:PORT, for example 127.0.0.1:0 for any free port"
    )]
    Address {
        /// The address as given.
        address: String,
        /// The reason.
        source: std::io::Error,
    },
    /// The system did not return a random number for the token.
    #[error("no token can be made: {0}\n  help: run without --serve")]
    Token(String),
}

/// A listening socket, until it is dropped.
pub struct Server {
    address: SocketAddr,
    token: String,
    closing: Arc<AtomicBool>,
    pub(crate) fresh: Receiver<Guest>,
}

/// A client after its hello.
pub(crate) struct Guest {
    requests: Receiver<Request>,
    replies: Replies,
    socket: TcpStream,
}

/// A reply in the queue.
enum Waiting {
    /// An encoded frame for the connection.
    Frame(Vec<u8>),
    /// A sample of a watch. The writer's thread formats it, so the run's thread only copies numbers.
    Row(u64, Row),
}

/// A sample of a watch.
pub(crate) struct Row {
    /// Simulated time (s).
    pub time: f64,
    /// The numbers.
    pub values: Vec<f64>,
    /// Number of earlier samples that were lost.
    pub lost: u64,
}

impl Row {
    /// Returns an upper bound of the size of its frame: 24 bytes for a number and a comma, and the text around the numbers.
    fn longest(&self) -> usize {
        25 * self.values.len() + 160
    }

    pub(crate) fn said(&self) -> ReplyKind {
        let values = self.values.iter().map(|x| Some(*x).filter(|x| x.is_finite())).collect();
        ReplyKind::Values { time: self.time, values, lost: self.lost }
    }
}

impl Waiting {
    /// Returns the bytes that it counts in the queue.
    fn length(&self) -> usize {
        match self {
            Waiting::Frame(bytes) => bytes.len(),
            Waiting::Row(_, row) => row.longest(),
        }
    }
}

/// The sending end of the queue of replies.
#[derive(Clone)]
struct Replies {
    queue: SyncSender<Waiting>,
    /// Bytes that are queued or being written.
    bytes: Arc<AtomicUsize>,
}

/// The writing end of the queue.
struct Unwritten {
    queue: Receiver<Waiting>,
    bytes: Arc<AtomicUsize>,
}

/// Creates a queue of at most [`REPLIES`] replies with at most [`LONGEST_REPLY`] bytes together.
fn replies() -> (Replies, Unwritten) {
    let (send, receive) = sync_channel(REPLIES);
    let bytes = Arc::new(AtomicUsize::new(0));
    (Replies { queue: send, bytes: bytes.clone() }, Unwritten { queue: receive, bytes })
}

impl Replies {
    /// Adds a reply. Returns false if the queue is full. If the client has disconnected, the reply counts as sent.
    fn push(&self, reply: Waiting) -> bool {
        // The longest reply, including the four bytes of its length, fits if no other reply waits.
        let (length, most) = (reply.length(), LONGEST_REPLY + 4);
        let add = |waiting: usize| waiting.checked_add(length).filter(|sum| *sum <= most);
        if self.bytes.fetch_update(Ordering::SeqCst, Ordering::SeqCst, add).is_err() {
            return false;
        }
        match self.queue.try_send(reply) {
            Ok(()) => true,
            Err(e) => {
                self.bytes.fetch_sub(length, Ordering::SeqCst);
                matches!(e, TrySendError::Disconnected(_))
            }
        }
    }
}

impl Unwritten {
    /// Writes replies until a write fails or the queue is closed.
    fn write(self, mut to: impl Write) {
        while let Ok(reply) = self.queue.recv() {
            let length = reply.length();
            let written = match reply {
                Waiting::Frame(bytes) => to.write_all(&bytes).is_ok(),
                Waiting::Row(id, row) => {
                    let reply = Reply { id, said: row.said() };
                    frame(&reply, LONGEST_REPLY).is_ok_and(|bytes| to.write_all(&bytes).is_ok())
                }
            };
            self.bytes.fetch_sub(length, Ordering::SeqCst);
            if !written {
                return;
            }
        }
    }
}

impl Guest {
    /// Returns the next request; `None` if there is none at present, an error if the client has disconnected.
    pub fn next(&self) -> Result<Option<Request>, ()> {
        match self.requests.try_recv() {
            Ok(request) => Ok(Some(request)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(()),
        }
    }

    /// Sends a reply. Returns false if the queue is full.
    pub fn send(&self, reply: &Reply) -> bool {
        let bytes = frame(reply, LONGEST_REPLY).or_else(|e| {
            let (message, help) = (e.to_string(), "request fewer variables".to_string());
            frame(
                &Reply { id: reply.id, said: ReplyKind::Refused { message, help } },
                LONGEST_REPLY,
            )
        });
        bytes.is_ok_and(|bytes| self.replies.push(Waiting::Frame(bytes)))
    }

    /// Sends a sample of the watch `id`. Returns false if the queue is full. Cost: moving the sample; only a sample that may exceed the largest reply
    /// is formatted at once, to check its size.
    pub fn row(&self, id: u64, row: Row) -> bool {
        match row.longest() <= LONGEST_REPLY {
            true => self.replies.push(Waiting::Row(id, row)),
            false => self.send(&Reply { id, said: row.said() }),
        }
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        // Replies that were already written still arrive. The thread that reads from this
        // connection ends.
        let _ = self.socket.shutdown(Shutdown::Read);
    }
}

impl Server {
    /// Listens at an address (`127.0.0.1:0`: only this machine, any free port). Clients receive the name `simulation`.
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn start(address: &str, simulation: &str) -> Result<Server, ServeError> {
        let fault = |source| ServeError::Address { address: address.to_string(), source };
        let listener = TcpListener::bind(address).map_err(fault)?;
        let bound = listener.local_addr().map_err(fault)?;
        let mut random = [0; 24];
        getrandom::fill(&mut random).map_err(|e| ServeError::Token(e.to_string()))?;
        let token: String = random.iter().map(|b| format!("{b:02x}")).collect();
        let (send, fresh) = channel();
        let closing = Arc::new(AtomicBool::new(false));
        let hall = Hall {
            token: token.clone(),
            simulation: simulation.to_string(),
            open: Arc::new(AtomicUsize::new(0)),
            strangers: Arc::default(),
            closing: closing.clone(),
            send,
        };
        let accept = move || hall.accept(&listener);
        std::thread::Builder::new().name("live".into()).spawn(accept).map_err(fault)?;
        Ok(Server { address: bound, token, closing, fresh })
    }

    /// Returns its address.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the token that a client must send.
    pub fn token(&self) -> &str {
        &self.token
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::SeqCst);
        // Wake up the thread that accepts connections.
        let _ = TcpStream::connect_timeout(&self.address, Duration::from_millis(200));
    }
}

/// Data of the thread that accepts connections.
#[derive(Clone)]
struct Hall {
    token: String,
    simulation: String,
    /// Number of clients after their hello.
    open: Arc<AtomicUsize>,
    /// Connections before their hello, by number, the oldest first.
    strangers: Arc<Mutex<BTreeMap<u64, TcpStream>>>,
    closing: Arc<AtomicBool>,
    send: Sender<Guest>,
}

/// Counts a connection until it is dropped.
struct Seat(Arc<AtomicUsize>);

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

impl Hall {
    fn accept(&self, listener: &TcpListener) {
        for (number, socket) in (0..).zip(listener.incoming()) {
            if self.closing.load(Ordering::SeqCst) {
                return;
            }
            let Ok((socket, own)) = socket.and_then(|s| s.try_clone().map(|own| (s, own))) else {
                // The cause is too many open descriptors, or a connection that was closed at once.
                // Both are temporary.
                std::thread::sleep(Duration::from_millis(10));
                continue;
            };
            let mut strangers = self.strangers();
            while strangers.len() >= STRANGERS {
                // Closing the connection ends its thread.
                if let Some((_, oldest)) = strangers.pop_first() {
                    let _ = oldest.shutdown(Shutdown::Both);
                }
            }
            strangers.insert(number, own);
            drop(strangers);
            let hall = self.clone();
            let serve = move || hall.serve(&socket, number);
            if std::thread::Builder::new().name("live client".into()).spawn(serve).is_err() {
                self.strangers().remove(&number);
            }
        }
    }

    fn strangers(&self) -> MutexGuard<'_, BTreeMap<u64, TcpStream>> {
        self.strangers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Serves one client until it disconnects. Errors end only this connection.
    fn serve(&self, socket: &TcpStream, number: u64) {
        let welcome = self.hello(socket);
        self.strangers().remove(&number);
        let seat = Seat(self.open.clone());
        let full = self.open.fetch_add(1, Ordering::SeqCst) >= CLIENTS;
        let welcome = welcome.and_then(|id| match full {
            true => Err((
                format!("{CLIENTS} clients are connected, which is the limit"),
                "disconnect one of them".to_string(),
            )),
            false => Ok(id),
        });
        let begun = welcome.and_then(|id| {
            let said = ReplyKind::Welcome { version: VERSION, simulation: self.simulation.clone() };
            write_frame(&mut &*socket, &Reply { id, said }, LONGEST_REPLY)
                .map_err(|e| (e.to_string(), "connect again".to_string()))
        });
        if let Err(refusal) = begun {
            let said = ReplyKind::Refused { message: refusal.0, help: refusal.1 };
            let _ = write_frame(&mut &*socket, &Reply { id: 0, said }, LONGEST_REPLY);
            return;
        }
        let _seat = seat;
        let (send, requests) = sync_channel(REQUESTS);
        let (replies, unwritten) = replies();
        let (Ok(own), Ok(writer)) = (socket.try_clone(), socket.try_clone()) else { return };
        let guest = Guest { requests, replies: replies.clone(), socket: own };
        let write = move || {
            unwritten.write(&writer);
            let _ = writer.shutdown(Shutdown::Both);
        };
        let spawned = std::thread::Builder::new().name("live writer".into()).spawn(write);
        if spawned.is_err() || self.send.send(guest).is_err() {
            return;
        }
        let mut from = std::io::BufReader::new(socket);
        loop {
            match read_frame(&mut from, LONGEST_REQUEST) {
                Ok(request) => {
                    if send.send(request).is_err() {
                        return;
                    }
                }
                Err(FrameError::Ended) => return,
                Err(e) => {
                    let help = "see PROTOCOL.md; the connection is closed".to_string();
                    let said = ReplyKind::Refused { message: e.to_string(), help };
                    if let Ok(bytes) = frame(&Reply { id: 0, said }, LONGEST_REPLY) {
                        replies.push(Waiting::Frame(bytes));
                    }
                    return;
                }
            }
        }
    }

    /// Reads the first message, with version and token. Returns its number.
    fn hello(&self, socket: &TcpStream) -> Result<u64, (String, String)> {
        let words = |m: &str, h: &str| (m.to_string(), h.to_string());
        let io = |e: std::io::Error| (e.to_string(), "connect again".to_string());
        socket.set_nodelay(true).map_err(io)?;
        socket.set_write_timeout(Some(PATIENCE)).map_err(io)?;
        let mut patient = Patient { socket, until: now() + PATIENCE };
        let first: Request = read_frame(&mut patient, LONGEST_HELLO)
            .map_err(|e| (e.to_string(), "send hello first".to_string()))?;
        let RequestKind::Hello { version, token } = first.ask else {
            return Err(words("the first message is not hello", "send hello first"));
        };
        if !same(token.as_bytes(), self.token.as_bytes()) {
            let help = "take it from live.json in the folder of the run";
            return Err(words("the token does not belong to this run", help));
        }
        if version != VERSION {
            let message = format!("protocol {version} is not supported");
            return Err((message, format!("use protocol {VERSION}")));
        }
        socket.set_read_timeout(None).map_err(io)?;
        Ok(first.id)
    }
}

/// The wall clock limits the time to wait for clients.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
}

/// A socket with a deadline for reading, independent of the pace of its bytes.
struct Patient<'a> {
    socket: &'a TcpStream,
    until: Instant,
}

impl Read for Patient<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let left = self.until.saturating_duration_since(now());
        if left.is_zero() {
            return Err(std::io::ErrorKind::TimedOut.into());
        }
        self.socket.set_read_timeout(Some(left))?;
        (&*self.socket).read(into)
    }
}

/// Compares in constant time, so that the duration does not reveal the position of the first difference.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zeros(n: usize) -> Waiting {
        Waiting::Frame(vec![0; n])
    }

    #[test]
    fn a_row_waits_as_numbers_and_is_never_longer_than_it_is_counted_as() {
        // Test the longest possible numbers, and values that are not finite.
        let extremes = [-f64::MIN_POSITIVE / 3.0, -f64::MAX, -1.0 / 3.0 * 1e-300, f64::NAN, 0.1];
        let values: Vec<f64> = (0..1000).map(|k| extremes[k % 5]).collect();
        let row = |lost| Row { time: -f64::MAX, values: values.clone(), lost };
        let (send, unwritten) = replies();
        let longest = row(u64::MAX).longest();
        assert!(send.push(Waiting::Row(u64::MAX, row(u64::MAX))));
        assert_eq!(send.bytes.load(Ordering::SeqCst), longest);
        let (bytes, mut all) = (send.bytes.clone(), Vec::new());
        drop(send);
        unwritten.write(&mut all);
        assert!(bytes.load(Ordering::SeqCst) == 0 && all.len() <= longest, "{}", all.len());
        let read: Reply = read_frame(&mut &all[..], LONGEST_REPLY).unwrap();
        let ReplyKind::Values { values: read, lost, .. } = read.said else { panic!("{read:?}") };
        assert_eq!((read.len(), lost), (1000, u64::MAX));
        for (read, sent) in read.iter().zip(&values) {
            assert_eq!(read.map(f64::to_bits), Some(sent.to_bits()).filter(|_| sent.is_finite()));
        }
    }

    #[test]
    fn replies_that_wait_are_bounded_in_number_and_in_bytes() {
        let (send, unwritten) = replies();
        assert!((0..REPLIES).all(|_| send.push(zeros(10))));
        assert!(!send.push(zeros(10)), "more than {REPLIES} wait");
        drop(send);
        let mut all = Vec::new();
        unwritten.write(&mut all);
        assert_eq!(all.len(), 10 * REPLIES);

        let (send, unwritten) = replies();
        let half = LONGEST_REPLY / 2;
        assert!(send.push(zeros(half)) && send.push(zeros(half)));
        assert!(!send.push(zeros(half)), "more than {LONGEST_REPLY} bytes wait");
        assert!(send.push(zeros(4)), "a short one still fits");
        let Unwritten { queue, bytes } = unwritten;
        // Sending a message makes room for another one.
        let (first, rest) = (queue.recv().unwrap(), queue);
        bytes.fetch_sub(first.length(), Ordering::SeqCst);
        assert!(send.push(zeros(half)));
        // The longest reply fits if it is the only one. If the reader is gone, `push` still succeeds.
        let (send, unwritten) = replies();
        assert!(send.push(zeros(LONGEST_REPLY + 4)) && !send.push(zeros(1)));
        drop((rest, unwritten));
        let (send, unwritten) = replies();
        drop(unwritten);
        assert!(send.push(zeros(1)) && send.bytes.load(Ordering::SeqCst) == 0);
    }
}
