//! The reader of messages with random input: it rejects it, and never allocates more memory than it has received.
#![allow(clippy::unwrap_used)]
#[path = "../../../tests/fuzz/mutate.rs"]
mod mutate;
use linkwork_live::*;

fn requests() -> Vec<Request> {
    let paths = || vec!["bob.angle".to_string(), "Lag.y".into()];
    let asks = [
        RequestKind::Hello { version: VERSION, token: "0123".into() },
        RequestKind::List { patterns: vec!["**".into()] },
        RequestKind::Get { paths: paths() },
        RequestKind::Set { path: "bob.angle".into(), value: Amount::Number(-0.25) },
        RequestKind::Set { path: "bob.angle".into(), value: Amount::Text("12 deg".into()) },
        RequestKind::Pin { path: "bob.*".into(), value: Some(Amount::Number(0.5)) },
        RequestKind::Pin { path: "bob.*".into(), value: None },
        RequestKind::Unpin { path: "**".into() },
        RequestKind::Pins,
        RequestKind::Watch { paths: paths(), rate: 100.0 },
        RequestKind::Pause,
        RequestKind::Step { steps: 7 },
        RequestKind::Go,
        RequestKind::Checkpoint,
        RequestKind::Quit,
    ];
    asks.into_iter().zip(1..).map(|(ask, id)| Request { id, ask }).collect()
}

fn read(bytes: &[u8]) -> Result<Request, FrameError> {
    read_frame(&mut &bytes[..], LONGEST_REQUEST)
}

#[test]
fn messages_come_back_and_are_as_the_protocol_says() {
    let mut all = Vec::new();
    for request in requests() {
        write_frame(&mut all, &request, LONGEST_REQUEST).unwrap();
    }
    let mut from = &all[..];
    for request in requests() {
        assert_eq!(read_frame::<Request>(&mut from, LONGEST_REQUEST).unwrap(), request);
    }
    assert!(matches!(read_frame::<Request>(&mut from, LONGEST_REQUEST), Err(FrameError::Ended)));
    // Every request in PROTOCOL.md must be readable.
    let page = include_str!("../PROTOCOL.md");
    let rows = page.lines().filter(|l| l.starts_with("| `")).map(|l| l.split('|').nth(1).unwrap());
    let mut seen = 0;
    for ask in rows.flat_map(|row| row.split('`').skip(1).step_by(2)) {
        let ask = ask.replace("[..]", "[]");
        if ask.starts_with("\"value\"") {
            continue;
        }
        let text = format!("{{\"id\": 1, \"ask\": {ask}}}");
        serde_json::from_str::<Request>(&text).unwrap_or_else(|e| panic!("{text}: {e}"));
        seen += 1;
    }
    assert_eq!(seen, 14, "requests on the page");
}

#[test]
fn junk_is_refused_and_nothing_panics() {
    let mut dice = mutate::Dice::new(7);
    let mut read_ok = 0;
    for request in requests() {
        let mut whole = Vec::new();
        write_frame(&mut whole, &request, LONGEST_REQUEST).unwrap();
        for n in 0..whole.len() {
            assert!(read(&whole[..n]).is_err(), "cut after {n} bytes");
        }
        for _ in 0..2000 {
            let mut bytes = whole.clone();
            for _ in 0..=dice.next() % 3 {
                let k = dice.next() as usize % bytes.len();
                bytes[k] ^= 1 << (dice.next() % 8);
            }
            read_ok += usize::from(read(&bytes).is_ok());
        }
    }
    // Some mutations give other valid messages, because they change a digit or a letter of a path.
    assert!(read_ok > 0 && read_ok < 11_000, "{read_ok}");
    for _ in 0..20_000 {
        let bytes: Vec<u8> = (0..dice.next() % 64).map(|_| dice.next() as u8).collect();
        assert!(read(&bytes).is_err());
    }
    // Test endlessly nested JSON and unknown fields.
    let framed = |text: String| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    for text in [
        "[".repeat(60_000),
        "{\"id\":1,\"ask\":".repeat(4000),
        "{\"id\": 1, \"ask\": \"pause\", \"run\": \"rm\"}".into(),
        "{\"id\": -1, \"ask\": \"pause\"}".into(),
        "{\"id\": 1, \"ask\": {\"step\": {\"steps\": 1e300}}}".into(),
        "{\"id\": 1, \"ask\": \"exec\"}".into(),
        String::new(),
    ] {
        assert!(matches!(read(&framed(text.clone())), Err(FrameError::Message(_))), "{text:.60}");
    }
}

#[test]
fn mutations_of_messages_are_read_or_refused() {
    let framed = |request: &Request| {
        let mut bytes = Vec::new();
        write_frame(&mut bytes, request, 2 * LONGEST_REQUEST).unwrap();
        bytes
    };
    let seeds: Vec<Vec<u8>> = requests().iter().map(framed).collect();
    mutate::survives(&[seeds, mutate::kept("socket")].concat(), 20_000, |bytes| {
        // Read several messages in sequence, as from a connection.
        let mut from = bytes;
        let mut any = false;
        while let Ok(request) = read_frame::<Request>(&mut from, LONGEST_REQUEST) {
            // A message that was read can be written again.
            framed(&request);
            any = true;
        }
        any
    });
}

/// Announces four gigabytes and counts the requested bytes.
struct Endless(u64);

impl std::io::Read for Endless {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        into.fill(0xff);
        self.0 += into.len() as u64;
        Ok(into.len())
    }
}

#[test]
fn a_length_that_is_claimed_takes_no_memory() {
    let mut endless = Endless(0);
    let e = read_frame::<Request>(&mut endless, LONGEST_REQUEST).unwrap_err();
    assert!(matches!(e, FrameError::Long { length: 0xffff_ffff, most: LONGEST_REQUEST }), "{e}");
    assert_eq!(endless.0, 4, "it read on");
    // A message that is too long is not written, either.
    let long =
        Request { id: 1, ask: RequestKind::Get { paths: vec!["x".repeat(LONGEST_REQUEST)] } };
    let mut out = Vec::new();
    assert!(write_frame(&mut out, &long, LONGEST_REQUEST).is_err() && out.is_empty());
}
