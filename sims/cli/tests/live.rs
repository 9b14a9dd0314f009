//! The live socket: values set by clients are logged and reproduced bit for bit; bad clients change nothing.
use crate::common;
use common::{Lab, Said, edited, wait_for};
use linkwork_live::{Amount, Client, ClientError, ReplyKind, RequestKind, Ticket, VERSION};
use linkwork_record::read_log_contents;
use linkwork_runtime::Change;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// Starts a run with a server; returns the process and its ticket.
fn served(lab: &Lab, out: &str, more: &[&str]) -> (Child, Ticket) {
    // The log has a row at every step, and a metric covers every step.
    let mean = "unit: \"rad/s\"), \"mean speed\": (of: \"bob.rate\", take: \"mean\") }";
    let edits = [("rate: \"100 Hz\"", "rate: \"1 kHz\""), ("unit: \"rad/s\") }", mean)];
    lab.write("sim.ron", &edited(&edits));
    let head = ["run", "sim.ron", "--out", out, "--save-rrd", "off", "--serve"];
    let child = lab.spawn(&[&head[..], more].concat());
    let file = lab.path(out).join(Ticket::FILE);
    wait_for(&file);
    let ticket = Ticket::read(&file).unwrap();
    (child, ticket)
}

fn refused<T: std::fmt::Debug>(answer: Result<T, ClientError>, what: &str) {
    match answer {
        Err(ClientError::Refused { message, help }) => {
            assert!(message.contains(what) && !help.is_empty(), "{message} {help}");
        }
        other => panic!("{other:?} instead of: {what}"),
    }
}

fn time(answer: Result<ReplyKind, ClientError>) -> f64 {
    match answer.unwrap() {
        ReplyKind::Done { time } => time,
        other => panic!("{other:?}"),
    }
}

fn set(client: &mut Client, path: &str, value: Amount) -> Result<ReplyKind, ClientError> {
    client.ask(RequestKind::Set { path: path.into(), value })
}

#[test]
fn what_is_set_is_in_the_log_and_is_simulated_again() {
    let lab = Lab::new();
    let (child, ticket) = served(&lab, "out", &["--realtime", "--until", "1000s"]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let mode = lab.path("out/live.json").metadata().unwrap().mode();
        assert_eq!(mode & 0o777, 0o600, "{mode:o}");
    }
    assert!(ticket.address.starts_with("127.0.0.1:"), "{ticket:?}");
    let mut client = Client::connect(&ticket).unwrap();
    let paused = time(client.ask(RequestKind::Pause));
    assert_eq!(time(client.ask(RequestKind::Pause)), paused, "it does not stand still");
    set(&mut client, "bob.angle", Amount::Text("30 deg".into())).unwrap();
    set(&mut client, "bob.rate", Amount::Number(0.1 + 0.2)).unwrap();
    set(&mut client, "bob.rate", Amount::Number(1.0 / 3.0)).unwrap();
    let paths = vec!["bob.angle".to_string(), "bob.rate".into()];
    let ReplyKind::Values { values, .. } = client.ask(RequestKind::Get { paths }).unwrap() else {
        panic!()
    };
    let wanted = [30.0f64.to_radians(), 1.0 / 3.0];
    for (value, wanted) in values.into_iter().zip(wanted) {
        assert!((value.unwrap() - wanted).abs() < 1e-15);
    }
    // Values that cannot be set are rejected.
    for (path, value, why) in [
        ("bob.acceleration", Amount::Number(1.0), "is an output"),
        ("Lag.u", Amount::Number(1.0), "driven by a wire"),
        ("bob.angel", Amount::Number(1.0), "no variable"),
        ("bob.angle", Amount::Text("3 kg".into()), "a different quantity than kg"),
        ("bob.angle", Amount::Text("much".into()), "not a quantity"),
    ] {
        refused(set(&mut client, path, value), why);
    }
    refused(client.ask(RequestKind::Step { steps: u64::MAX }), "too many");
    for rate in [2000.0, 0.0, 1e-20, 5e-324, -1.0] {
        refused(client.ask(RequestKind::Watch { paths: vec![], rate }), "the rate is ");
    }
    refused(client.ask(RequestKind::List { patterns: vec!["*.".repeat(200)] }), "too long");
    refused(
        client.ask(RequestKind::Hello { version: VERSION, token: ticket.token.clone() }),
        "only allowed as the first message",
    );
    // A request for steps is answered after its last step, and the run does not go further.
    let after = time(client.ask(RequestKind::Step { steps: 250 }));
    assert!((after - paused - 0.25).abs() < 1e-9, "{paused} → {after}");
    assert_eq!(time(client.ask(RequestKind::Pause)), after);
    let ReplyKind::Checkpoint { file } = client.ask(RequestKind::Checkpoint).unwrap() else {
        panic!()
    };
    // Another client stops the run in the middle of the steps.
    let id = client.send(RequestKind::Step { steps: 1_000_000_000 }).unwrap();
    let mut other = Client::connect(&ticket).unwrap();
    let now = |other: &mut Client| match other.ask(RequestKind::Get { paths: vec![] }).unwrap() {
        ReplyKind::Values { time, .. } => time,
        said => panic!("{said:?}"),
    };
    while now(&mut other) <= after {}
    other.ask(RequestKind::Pause).unwrap();
    let reply = client.receive().unwrap();
    match reply.said {
        ReplyKind::Refused { message, .. } => {
            assert!(message.contains("`pause`") && reply.id == id)
        }
        said => panic!("{said:?}"),
    }
    drop(other);
    set(&mut client, "bob.rate", Amount::Number(-2.0)).unwrap();
    client.ask(RequestKind::Go).unwrap();
    let id =
        client.send(RequestKind::Watch { paths: vec!["bob.angle".into()], rate: 100.0 }).unwrap();
    let mut rows = Vec::new();
    while rows.len() < 20 {
        let reply = client.receive().unwrap();
        if let (true, ReplyKind::Values { time, .. }) = (reply.id == id, reply.said) {
            rows.push(time);
        }
    }
    assert!(rows.is_sorted() && rows[19] > rows[0] + 0.1, "{rows:?}");
    client.ask(RequestKind::Quit).unwrap();
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(130);
    assert!(!lab.path("out/live.json").exists());

    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    let sets: Vec<(&str, f64)> = log.sets.iter().map(|s| (&*s.path, s.value)).collect();
    assert_eq!(sets.len(), 4, "{sets:?}");
    assert_eq!(sets[1..], [("bob.rate", 0.1 + 0.2), ("bob.rate", 1.0 / 3.0), ("bob.rate", -2.0)]);
    // The row at the tick of the last set has the set value.
    let rate = &log.series["bob.rate"];
    let t = log.sets[3].ns as f64 * 1e-9;
    let k = rate.t.iter().position(|s| (s - t).abs() < 1e-9).unwrap();
    assert_eq!(rate.y[k], -2.0);
    let said = lab.linkwork(&["replay", "out/run.mcap", "--verify"]).code(0);
    assert!(said.out.starts_with("verified: "), "{}", said.out);
    // The checkpoint between the sets continues, and the log of the continuation is verified
    // without the earlier sets.
    let until = format!("{}s", after + 0.2);
    lab.linkwork(&["resume", &file, "--out", "rest", "--until", &until]).code(0);
    lab.linkwork(&["replay", "rest/run.mcap", "--verify"]).code(0);
}

/// A client requests a checkpoint before the watcher has seen the tick: a run that continues from it counts the tick once.
#[test]
fn a_checkpoint_that_is_asked_for_takes_no_tick_of_the_metrics_away() {
    let lab = Lab::new();
    let (child, ticket) = served(&lab, "out", &["--realtime", "--until", "1000s"]);
    let mut client = Client::connect(&ticket).unwrap();
    let paused = time(client.ask(RequestKind::Pause));
    // The rate is this high only at this tick.
    set(&mut client, "bob.angle", Amount::Number(0.0)).unwrap();
    set(&mut client, "bob.rate", Amount::Number(50.0)).unwrap();
    let ReplyKind::Checkpoint { file } = client.ask(RequestKind::Checkpoint).unwrap() else {
        panic!()
    };
    let after = time(client.ask(RequestKind::Step { steps: 20 }));
    let ReplyKind::Checkpoint { file: later } = client.ask(RequestKind::Checkpoint).unwrap() else {
        panic!()
    };
    client.ask(RequestKind::Quit).unwrap();
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(130);
    for (file, out) in [(&file, "rest"), (&later, "later")] {
        let until = format!("{}s", after + 0.1);
        lab.linkwork(&["resume", file, "--out", out, "--until", &until]).code(0);
    }
    let log = |out: &str| read_log_contents(&lab.path(&format!("{out}/run.mcap"))).unwrap();
    let first = log("rest").series["bob.rate"].clone();
    assert!((first.t[0] - paused).abs() < 1e-9 && first.y[0] == 50.0, "its row is not in the log");
    assert!(first.y[1..].iter().all(|y| *y < 50.0), "{:?}", &first.y[..3]);
    for out in ["out", "rest", "later"] {
        let metrics = &lab.summary(out)["metrics"];
        assert_eq!(metrics["largest speed"][0].as_f64(), Some(50.0), "{out}: {metrics}");
    }
    // Each instant counts once: the means of the run and its continuation equal the means of rows at intervals of 1 ms.
    // Until the instant of the set, the variable keeps its previous value.
    let ramps = |y: &[f64]| y.windows(2).map(|y| 0.5e-3 * (y[0] + y[1])).sum::<f64>();
    let before = log("out").series["bob.rate"].clone();
    let until = |t: f64| before.t.iter().take_while(|s| **s < t - 1e-9).count();
    for (out, cut) in [("rest", paused), ("later", after)] {
        let rows = [&before.y[..until(cut)], &log(out).series["bob.rate"].y[..]].concat();
        let set = until(paused);
        let all = ramps(&rows[..set]) + 1e-3 * rows[set - 1] + ramps(&rows[set..]);
        let wanted = all / (1e-3 * (rows.len() - 1) as f64);
        let told = lab.summary(out)["metrics"]["mean speed"][0].as_f64().unwrap();
        // The tolerance is due to the reference: it keeps the rate constant in the last step before the set, where it
        // changes by some thousandths, and integrates the 1 ms rows by trapezoids.
        assert!((told - wanted).abs() < 1e-4 * wanted.abs(), "{out}: {told} against {wanted}");
    }
}

fn changed(answer: Result<ReplyKind, ClientError>) -> Vec<(String, f64)> {
    match answer.unwrap() {
        ReplyKind::Changed { values, .. } | ReplyKind::Pins { values, .. } => values,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_pinned_stays_is_in_the_log_and_is_simulated_again() {
    let lab = Lab::new();
    let (child, ticket) = served(&lab, "out", &["--realtime", "--until", "1000s"]);
    let mut client = Client::connect(&ticket).unwrap();
    client.ask(RequestKind::Pause).unwrap();
    let pin = |path: &str, value| RequestKind::Pin { path: path.into(), value };
    let unpin = |path: &str| RequestKind::Unpin { path: path.into() };
    // A pattern pins all states and outputs that match, each at its present value.
    let names = changed(client.ask(pin("bob.*", None)));
    let paths: Vec<&str> = names.iter().map(|(path, _)| &**path).collect();
    assert_eq!(paths, ["bob.acceleration", "bob.angle", "bob.rate"]);
    assert_eq!(changed(client.ask(RequestKind::Pins)), names);
    refused(set(&mut client, "bob.rate", Amount::Number(1.0)), "is pinned to");
    assert_eq!(changed(client.ask(unpin("bob.*"))), names);
    refused(client.ask(unpin("**")), "does not match a pinned variable");
    refused(client.ask(unpin("bob.rate")), "is not pinned");
    // Units are converted, and a set is applied completely or not at all.
    refused(
        client.ask(pin("bob.*", Some(Amount::Text("3 deg".into())))),
        "a different quantity than deg",
    );
    refused(client.ask(pin("bob.*.x", None)), "matches no variable that can be pinned");
    refused(client.ask(pin("Lag.u", Some(Amount::Number(1.0)))), "it only reads");
    assert_eq!(changed(client.ask(RequestKind::Pins)), []);
    changed(client.ask(pin("bob.angle", Some(Amount::Text("30 deg".into())))));
    changed(client.ask(pin("Lag.y", Some(Amount::Number(0.1 + 0.2)))));
    let set_all =
        RequestKind::Set { path: "*.rate".into(), value: Amount::Text("10 deg/s".into()) };
    assert_eq!(changed(client.ask(set_all)), [("bob.rate".to_string(), 10.0f64.to_radians())]);
    let after = time(client.ask(RequestKind::Step { steps: 200 }));
    let ReplyKind::Checkpoint { file } = client.ask(RequestKind::Checkpoint).unwrap() else {
        panic!()
    };
    changed(client.ask(unpin("bob.angle")));
    client.ask(RequestKind::Step { steps: 100 }).unwrap();
    client.ask(RequestKind::Quit).unwrap();
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(130);

    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    let count = |what| log.sets.iter().filter(|s| s.change == what).count();
    let counts = [Change::Pin, Change::Unpin, Change::Set].map(count);
    assert_eq!(counts, [5, 4, 1], "{:?}", log.sets);
    let held = 30.0f64.to_radians();
    let angle = &log.series["bob.angle"];
    let rows = angle.t.iter().zip(&angle.y).filter(|(t, _)| **t > after - 0.19 && **t < after);
    assert!(rows.clone().count() > 150 && rows.clone().all(|(_, y)| *y == held));
    assert_ne!(*angle.y.last().unwrap(), held, "it goes on when it is let go");
    let said = lab.linkwork(&["replay", "out/run.mcap", "--verify"]).code(0);
    assert!(said.out.starts_with("verified: "), "{}", said.out);
    // The resumed run continues with the pin; its log is verified as well.
    let until = format!("{}s", after + 0.2);
    lab.linkwork(&["resume", &file, "--out", "rest", "--until", &until]).code(0);
    let rest = read_log_contents(&lab.path("rest/run.mcap")).unwrap();
    assert!(rest.series["bob.angle"].y.iter().all(|y| *y == held));
    lab.linkwork(&["replay", "rest/run.mcap", "--verify"]).code(0);
    let free = ["--out", "free", "--until", &until, "--unpin", "bob.*"];
    let said = lab.linkwork(&[&["resume", &*file], &free[..]].concat()).code(0);
    said.tells(&["`bob.angle` is no longer pinned"]);
    let free = read_log_contents(&lab.path("free/run.mcap")).unwrap();
    assert!(free.series["bob.angle"].y.iter().any(|y| *y != held));
    lab.linkwork(&["replay", "free/run.mcap", "--verify"]).code(0);
}

#[test]
fn a_run_begins_pinned_and_a_cut_leaves_no_trace() {
    let lab = Lab::new();
    lab.write("sim.ron", common::BASE);
    let pins = ["--pin", "bob.angle=12 deg", "--pin", "Lag.y"];
    let said = lab.run("sim.ron", "out", &[&pins[..], &["--checkpoint-every", "0.4s"]].concat());
    said.code(0).tells(&["`bob.angle` is pinned to 0.209"]);
    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    assert!(log.series["bob.angle"].y.iter().all(|y| *y == 12.0f64.to_radians()));
    lab.linkwork(&["replay", "out/run.mcap", "--verify"]).code(0);
    lab.resume("out/checkpoint_0.4.lwck", "rest", &[]).code(0);
    assert_eq!(lab.hash("rest"), lab.hash("out"));
    // Two checkpoints that differ only in a pin are not equal.
    let alone = ["--checkpoint-every", "0.4s", "--pin", "bob.angle=12 deg", "--pin", "bob.rate=0"];
    lab.run("sim.ron", "two", &alone).code(0);
    let two = ["out/checkpoint_0.4.lwck", "two/checkpoint_0.4.lwck"];
    let said = lab.linkwork(&["diff", two[0], two[1]]).code(1);
    assert!(said.out.contains("pin of bob.rate: only in the second"), "{}", said.out);
    // The file is not written before the whole command is valid.
    for (pin, why) in [
        ("Lag.u=1", "it only reads"),
        ("bob.angel=1", "no variable"),
        ("bob.angle=much", "not a quantity"),
        ("bob.angle=nan", "NaN"),
    ] {
        let said = lab.run("sim.ron", "none", &["--pin", pin]).code(2);
        said.tells(&["error: --pin", why, "help: "]);
    }
    lab.run("sim.ron", "none", &["--unpin", "bob.angle"]).code(2).tells(&["is not pinned"]);
    assert!(!lab.path("none").exists());
}

/// A watch ends when its run ends.
#[test]
fn a_watch_ends_with_the_run() {
    let lab = Lab::new();
    let (child, _) = served(&lab, "out", &["--realtime", "--until", "3s"]);
    let said = lab.linkwork(&["attach", "out", "watch", "bob.angle", "--rate", "20"]).code(0);
    let last = said.out.lines().last().unwrap().split(' ').next().unwrap().to_string();
    assert!(last.parse::<f64>().unwrap() > 2.0, "{}", said.out);
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(0);
}

#[test]
fn bad_clients_neither_stop_nor_change_the_run() {
    let lab = Lab::new();
    let clock = Instant::now();
    let (child, ticket) = served(&lab, "out", &["--realtime", "--until", "4s"]);
    let connect = || TcpStream::connect(&ticket.address).unwrap();
    for token in [String::new(), "0".repeat(ticket.token.len())] {
        let ticket = Ticket { token, ..ticket.clone() };
        refused(Client::connect(&ticket).map(|_| ()), "token");
    }
    // The client sends no token: its first message is not hello.
    let mut socket = connect();
    let text = br#"{"id":1,"ask":"quit"}"#;
    socket.write_all(&[&(text.len() as u32).to_le_bytes()[..], text].concat()).unwrap();
    let mut answer = String::new();
    socket.read_to_string(&mut answer).unwrap_or(0);
    assert!(answer.contains("not hello"), "{answer:?}");
    // Invalid bytes arrive before hello, and after it.
    connect().write_all(&[0xff; 4096]).unwrap();
    connect().write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n").unwrap();
    // One client sends nothing, and one announces a long message and sends little.
    let _silent = connect();
    let mut slow = connect();
    slow.write_all(&[0xff, 0, 0, 0, b'{']).unwrap();
    // One client sends requests and never reads, and one floods the server.
    let mut deaf = Client::connect(&ticket).unwrap();
    let all = || RequestKind::List { patterns: vec!["**".into()] };
    deaf.send(RequestKind::Watch { paths: vec!["bob.angle".into(); 2000], rate: 1000.0 }).unwrap();
    let flood = std::thread::spawn({
        let ticket = ticket.clone();
        move || {
            let mut client = Client::connect(&ticket).unwrap();
            let mut sent = 0;
            // The server closes the connection after some time, because the client does not read.
            while sent < 100_000 && client.send(all()).is_ok() {
                sent += 1;
            }
            sent
        }
    });
    // A correct client works at the same time.
    let mut good = Client::connect(&ticket).unwrap();
    for _ in 0..10 {
        good.ask(RequestKind::Get { paths: vec!["bob.angle".into()] }).unwrap();
        std::thread::sleep(Duration::from_millis(50));
    }
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(0);
    assert!(clock.elapsed() < Duration::from_secs(12), "they held it up: {:?}", clock.elapsed());
    assert!(flood.join().unwrap() > 16);
    lab.run("sim.ron", "alone", &["--until", "4s"]).code(0);
    assert_eq!(lab.hash("out"), lab.hash("alone"));
    lab.linkwork(&["diff", "out/run.mcap", "alone/run.mcap"]).code(0);
}

#[test]
fn the_command_line_attaches_and_says_what_is_wrong() {
    let lab = Lab::new();
    let (child, _) = served(&lab, "out", &["--realtime", "--until", "1000s"]);
    let attach = |args: &[&str]| lab.linkwork(&[&["attach", "out"], args].concat());
    let said = attach(&["list", "bob.*"]).code(0);
    assert!(said.out.contains("bob.angle") && said.out.contains("rad"), "{}", said.out);
    attach(&["pause"]).code(0);
    attach(&["set", "bob.rate=0.25", "bob.angle=90 deg"]).code(0);
    let said = attach(&["get", "bob.angle", "bob.rate"]).code(0);
    assert!(said.out.contains("1.5707963267948966 rad"), "{}", said.out);
    let said = attach(&["step", "100"]).code(0);
    assert!(said.out.starts_with("t = "), "{}", said.out);
    let said = attach(&["pin", "bob.angle=45 deg", "bob.acceleration"]).code(0);
    assert!(said.out.contains("bob.angle = 0.785398") && said.out.lines().count() == 2);
    let said = attach(&["pins"]).code(0);
    assert!(said.out.contains("bob.acceleration") && said.out.lines().count() == 3);
    attach(&["unpin", "bob.*"]).code(0);
    assert_eq!(attach(&["pins"]).code(0).out.lines().count(), 1);
    attach(&["unpin", "bob.*"]).code(1).tells(&["does not match a pinned variable", "help: "]);
    attach(&["set", "bob.rate"]).code(1).tells(&["lacks a `=`", "help: "]);
    attach(&["go"]).code(0);
    let said = attach(&["watch", "bob.angle", "--rate", "100", "--count", "3"]).code(0);
    assert_eq!(said.out.lines().count(), 4, "{}", said.out);
    attach(&["set", "Lag.u=1"]).code(1).tells(&["driven by a wire", "help: "]);
    attach(&["get", "bob.angel"]).code(1).tells(&["bob.angel", "help: "]);
    let said = attach(&["checkpoint"]).code(0);
    assert!(lab.path(said.out.trim()).exists(), "{}", said.out);
    attach(&["quit"]).code(0);
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(130).tells(&["linkwork attach out"]);
    // A killed run leaves its ticket; the next run in the folder removes it.
    lab.write("out/live.json", "{}");
    lab.run("sim.ron", "out", &[]).code(0);
    assert!(!lab.path("out/live.json").exists());
    attach(&["go"]).code(2).tells(&["live.json", "--serve", "help: "]);
    // An invalid address does not remove the files of an earlier run.
    let before = lab.hash("out");
    lab.run("sim.ron", "out", &["--serve", "nonsense"])
        .code(2)
        .tells(&["--serve `nonsense`", "help: "]);
    assert!(lab.path("out/run.mcap").exists() && lab.hash("out") == before);
}

#[test]
fn python_attaches() {
    let python = Command::new("python3").arg("--version").output();
    if !python.is_ok_and(|o| o.status.success()) {
        assert!(std::env::var_os("CI").is_none(), "there is no python3");
        println!("skipped: there is no python3");
        return;
    }
    let lab = Lab::new();
    let (child, _) = served(&lab, "out", &["--realtime", "--until", "1000s"]);
    let script = r#"
import sys
sys.path.insert(0, sys.argv[1])
import live
with live.attach("out") as run:
    assert run.simulation and run.variables("bob.angle") == {"bob.angle": "rad"}
    t = run.pause()
    run.set("bob.angle", "90 deg")
    run.set("bob.rate", 0.5)
    assert abs(run.get("bob.angle") - 1.5707963267948966) < 1e-15
    assert run.get("bob.angle", "bob.rate")[1] == 0.5
    assert abs(run.step(100) - t - 0.1) < 1e-9
    for bad in [lambda: run.set("Lag.u", 1), lambda: run.get("nothing"), lambda: run.step(1 << 60),
                lambda: run.pin("Lag.u", 1), lambda: run.unpin("bob.*")]:
        try:
            bad()
        except live.Refused as e:
            assert "help: " in str(e)
        else:
            raise AssertionError("it is not refused")
    assert run.pin("bob.*") == run.pins() and len(run.pins()) == 3
    assert set(run.unpin("bob.*")) == {"bob.angle", "bob.rate", "bob.acceleration"}
    assert abs(run.pin("bob.angle", "90 deg")["bob.angle"] - 1.5707963267948966) < 1e-15
    run.pin("bob.rate", 2)
    run.step(100)
    assert run.get("bob.rate") == 2.0 and run.unpin() and run.pins() == {}
    run.go()
    rows = list(run.watch(["bob.angle", "bob.rate"], rate=100, count=5))
    assert len(rows) == 5 and all(len(values) == 2 for _, values in rows)
    assert rows[0][0] < rows[4][0]
    assert run.checkpoint().endswith(".lwck")
    run.quit()
"#;
    let module = common::root().join("sims/python/python/linkwork");
    let out = Command::new("python3")
        .args(["-B", "-c", script])
        .arg(module)
        .current_dir(lab.path(""))
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(130);
    lab.linkwork(&["replay", "out/run.mcap", "--verify"]).code(0);
}
