//! The page of `monitor --web` in Chromium, and requests that are not the page's: on a simulated board, over real sockets. The
//! browser talks to a go-between, which adds a person to the page and passes everything else on.
#![cfg(unix)]

mod common;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, ChildStdout, Stdio};
use std::time::Duration;

use common::{Board, folder};
use imu_stand::browser::Browser;
use serde_json::Value;

/// `monitor --web` under way.
struct Monitor {
    child: Child,
    /// Kept open: a program whose reader has gone ends.
    _output: BufReader<ChildStdout>,
    port: u16,
    token: String,
}

impl Monitor {
    fn start(board: &Board) -> Self {
        let arguments = ["monitor", "--web", "--port", board.port()];
        let mut command = common::program(&arguments);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut child = child.expect("it starts");
        let mut output = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        output.read_line(&mut line).expect("it says where");
        let (_, rest) = line
            .split_once("http://127.0.0.1:")
            .unwrap_or_else(|| panic!("{line}"));
        let (port, rest) = rest.split_once("/#").expect("a token");
        let token = rest.split(' ').next().expect("a token").to_owned();
        let port = port.parse().expect("a port");
        Monitor {
            child,
            _output: output,
            port,
            token,
        }
    }

    /// Status and body of the answer to a request, told as it is.
    fn ask(&self, text: &str) -> (String, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        stream
            .set_read_timeout(Some(Duration::from_secs(90)))
            .expect("a timeout");
        stream.write_all(text.as_bytes()).expect("it is sent");
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
        let status = head.split(' ').nth(1).unwrap_or_default().to_owned();
        (status, body.to_owned())
    }

    fn post(&self, path: &str, body: &str, headers: &[(&str, &str)]) -> String {
        let lines: String = headers
            .iter()
            .map(|(n, v)| format!("{n}: {v}\r\n"))
            .collect();
        let length = body.len();
        self.ask(&format!(
            "POST {path} HTTP/1.1\r\nContent-Length: {length}\r\n{lines}\r\n{body}"
        ))
        .0
    }

    /// The next snapshot.
    fn snapshot(&self) -> Value {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        stream
            .set_read_timeout(Some(Duration::from_secs(30)))
            .expect("a timeout");
        let request = format!(
            "GET /events?token={} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n",
            self.token, self.port
        );
        (&stream).write_all(request.as_bytes()).expect("it is sent");
        let lines = BufReader::new(stream).lines().map_while(Result::ok);
        let mut events = lines.filter_map(|line| Some(line.strip_prefix("data: ")?.to_owned()));
        serde_json::from_str(&events.next().expect("an event")).expect("JSON")
    }

    /// Waits until a snapshot is as it should be.
    fn until(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        let mut last = Value::Null;
        for _ in 0..60 {
            last = self.snapshot();
            if is(&last) {
                return last;
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        panic!("{what}: {last}")
    }
}

impl Drop for Monitor {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn another_site_another_user_and_another_computer_turn_no_motor() {
    let board = Board::start();
    let monitor = Monitor::start(&board);
    let host = format!("127.0.0.1:{}", monitor.port);
    let origin = format!("http://{host}");
    let (host, own) = (("Host", &*host), ("Origin", &*origin));
    let token = ("X-Imu-Stand-Token", &*monitor.token);
    let evil = [("Origin", "http://evil.example"), ("Origin", "null")];
    for headers in [
        vec![host, own],
        vec![host, token],
        vec![host, evil[0], token],
        vec![host, evil[1], token],
        vec![("Host", "evil.example"), own, token],
        vec![own, token],
        vec![host, own, ("X-Imu-Stand-Token", "0")],
        vec![host, host, own, token],
    ] {
        assert_eq!(
            monitor.post("/act", "motor 60", &headers),
            "403",
            "{headers:?}"
        );
        assert_eq!(
            monitor.post("/diagnose", "", &headers),
            "403",
            "{headers:?}"
        );
    }
    // As a link or a picture of another site would ask.
    let named = format!(
        "GET /act?token={} HTTP/1.1\r\nHost: {}\r\n\r\n",
        monitor.token, host.1
    );
    assert_eq!(monitor.ask(&named).0, "403");
    for path in ["/events", "/record.csv", "/nothing"] {
        let bare = format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", host.1);
        assert_eq!(monitor.ask(&bare).0, "403", "{path}");
    }
    assert_eq!(monitor.post("/act", "reboot", &[host, own, token]), "400");
    assert_eq!(monitor.ask("nonsense\r\n\r\n").0, "400");
    let page = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", host.1);
    let (status, page) = monitor.ask(&page);
    assert_eq!(status, "200");
    assert!(!page.contains(&monitor.token), "the page is for everybody");
    // Nothing of it has moved the motor.
    let quiet = monitor.until("samples", |s| s["samples"].as_u64().unwrap() > 20);
    assert_eq!(
        (&quiet["pwm"], &quiet["turns"]),
        (&Value::from(0), &Value::from(false))
    );
    // It listens on the loopback alone.
    let table = std::fs::read_to_string("/proc/net/tcp").expect("a table of sockets");
    let local = format!("0100007F:{:04X} 00000000:0000 0A", monitor.port);
    assert!(table.contains(&local), "{table}");
    assert!(!table.contains(&format!("00000000:{:04X} 00000000:0000 0A", monitor.port)));
}

#[test]
fn a_motor_that_nobody_watches_any_more_is_stopped() {
    let board = Board::start();
    let monitor = Monitor::start(&board);
    let host = format!("127.0.0.1:{}", monitor.port);
    let origin = format!("http://{host}");
    let headers = [
        ("Host", &*host),
        ("Origin", &*origin),
        ("X-Imu-Stand-Token", &*monitor.token),
    ];
    monitor.until("samples", |s| s["samples"].as_u64().unwrap() > 5);
    assert_eq!(monitor.post("/act", "motor 60", &headers), "204");
    monitor.until("it turns", |s| s["pwm"].as_i64().unwrap() > 0);
    // The page says nothing more: three seconds, and the ramp.
    let stopped = monitor.until("it stands", |s| s["pwm"] == 0 && s["turns"] == false);
    assert_eq!(stopped["said"], "the motor stands");
}

/// Does what a person would, and writes down what comes of it.
const PERSON: &str = r#"<script>
const hold = document.createElement('iframe');
document.body.append(hold);
hold.contentDocument.open();
const wrong = [], seen = {};
addEventListener('error', (event) => wrong.push(`script: ${event.message}`));
addEventListener('securitypolicyviolation', (event) => wrong.push(`asks for ${event.blockedURI}`));
const until = async (what, is) => {
  for (let k = 0; k < 600; k++) {
    if (is()) return;
    await new Promise((done) => setTimeout(done, 100));
  }
  wrong.push(`not within a minute: ${what}: ${part('said').textContent} ${part('figures').textContent} ${part('alarm').textContent} ${part('working').textContent}`);
};
const motor = () => Number((part('figures').textContent.match(/motor (-?\d+)/) || [0, 0])[1]);
(async () => {
  await until('samples', () => Number(document.body.dataset.samples) > 120);
  // A browser that is slow to start meets more than 120 samples in its first event; a course takes two.
  await until('a course of rates', () => document.querySelector('#rates path:not(.grid)'));
  seen.figures = part('figures').textContent;
  seen.rows = part('rows').innerText;
  seen.curves = [...document.querySelectorAll('#allan path:not(.grid)')].length;
  seen.filled = [...document.querySelectorAll('svg path:not(.band)')].filter((p) => getComputedStyle(p).fill !== 'none').length;
  seen.rates = [...document.querySelectorAll('#rates path:not(.grid)')].length;
  seen.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  part('motor').click();
  await until('a question', () => part('ask').open);
  seen.question = part('question').textContent;
  part('no').click();
  await new Promise((done) => setTimeout(done, 1500));
  seen.unconfirmed = motor();
  part('motor').click();
  part('yes').click();
  await until('it turns', () => motor() > 0);
  seen.turned = motor();
  part('stop').click();
  await until('it stands', () => motor() === 0 && part('said').textContent === 'the motor stands');
  part('null').click();
  part('yes').click();
  await until('the null is under way', () => part('said').textContent.includes('leave the table alone'));
  part('diagnose').click();
  await until('too short a record is told', () => part('working').textContent.includes('let it record for longer'));
  await until('half a minute', () => Number(document.body.dataset.samples) > 700);
  part('diagnose').click();
  await until('a report', () => !part('report').hidden);
  seen.report = part('report').srcdoc.length;
  seen.working = part('working').textContent;
  seen.requests = performance.getEntriesByType('resource').map((r) => new URL(r.name).host).filter((h) => h !== location.host);
  const shown = document.createElement('p');
  shown.textContent = 'SAID' + JSON.stringify({ ...seen, wrong }) + 'SAID';
  stream.close();
  // With the frame that goes on loading the page has loaded.
  document.body.replaceChildren(shown);
})();
</script></body>"#;

/// Passes a connection on; the page with the person in it.
fn pass(browser: &TcpStream, from: u16, to: u16, record: &str) -> std::io::Result<()> {
    let (from, to) = (format!("127.0.0.1:{from}"), format!("127.0.0.1:{to}"));
    let mut reader = BufReader::new(browser);
    let (mut head, mut length) = (String::new(), 0);
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line)? == 0 {
            return Ok(());
        }
        if let Some(value) = line.to_ascii_lowercase().strip_prefix("content-length:") {
            length = value.trim().parse().unwrap_or(0);
        }
        let is_end = line == "\r\n";
        let keeps = line.to_ascii_lowercase().starts_with("connection:");
        head += &if keeps {
            "Connection: close\r\n".to_owned()
        } else {
            line.replace(&from, &to)
        };
        if is_end {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    let mut server = TcpStream::connect(&to)?;
    server.write_all(head.as_bytes())?;
    server.write_all(&body)?;
    let mut out = browser;
    let person = match &head {
        head if head.starts_with("GET / ") => PERSON.to_owned(),
        head if head.starts_with("GET /engine ") => with_record(record),
        _ => String::new(),
    };
    if person.is_empty() {
        std::io::copy(&mut server, &mut out)?;
        return Ok(());
    }
    let mut page = String::new();
    server.read_to_string(&mut page)?;
    let (head, page) = page.split_once("\r\n\r\n").expect("a page");
    let page = page.replace("</body>", &person);
    let head: Vec<&str> = head
        .lines()
        .filter(|l| !l.starts_with("Content-Length"))
        .collect();
    write!(
        out,
        "{}\r\nContent-Length: {}\r\n\r\n{page}",
        head.join("\r\n"),
        page.len()
    )
}

/// Hands the page that runs the engine a record, as the page of the monitor does, and writes down what it says.
fn with_record(record: &str) -> String {
    let record = serde_json::to_string(record).expect("text");
    let script = r#"<script>
const hold = document.createElement('iframe');
document.body.append(hold);
hold.contentDocument.open();
const wrong = [];
addEventListener('error', (event) => wrong.push(`script: ${event.message}`));
addEventListener('securitypolicyviolation', (event) => wrong.push(`asks for ${event.blockedURI}`));
const noted = (what) => {
  const shown = document.createElement('p');
  const requests = performance.getEntriesByType('resource').map((r) => r.name).filter((n) => !n.startsWith('blob:'));
  shown.textContent = 'SAID' + JSON.stringify({ ...what, wrong, requests }) + 'SAID';
  document.body.replaceChildren(shown);
};
addEventListener('failed', ({ detail }) => noted({ failed: detail }));
addEventListener('finished', ({ detail }) => noted({ report: detail.html.length, what: detail.what, file: file.name }));
setTimeout(() => noted({ slow: part('said').textContent, shown: part('failed').textContent }), 100000);
window.opener = window;
const bytes = new TextEncoder().encode(RECORD).buffer;
postMessage({ name: 'record.csv', bytes }, location.origin);
</script></body>"#;
    script.replace("RECORD", &record)
}

/// Passes connections on to the monitor; its own port.
fn between(monitor: &Monitor, record: &str) -> u16 {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
    let (own, port) = (listener.local_addr().expect("a port").port(), monitor.port);
    let record = record.to_owned();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let record = record.clone();
            std::thread::spawn(move || pass(&stream, own, port, &record));
        }
    });
    own
}

/// What a page wrote down.
fn answer_of(dom: &str, console: &str) -> Value {
    let said = dom
        .split("SAID")
        .nth(1)
        .unwrap_or_else(|| panic!("no answer: {console}\n{dom:.3000}"));
    let said = said
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&nbsp;", "\u{a0}")
        .replace("&amp;", "&");
    serde_json::from_str(&said).expect("JSON")
}

#[test]
fn the_page_of_the_engine_is_served_with_what_was_recorded_or_says_how_to_build_it() {
    let board = Board::start();
    let monitor = Monitor::start(&board);
    let host = format!("127.0.0.1:{}", monitor.port);
    let get = |path: &str, host: &str| {
        monitor.ask(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
    };
    assert_eq!(get("/engine", "evil.example").0, "403");
    let (status, text) = get("/engine", &host);
    if status == "404" {
        assert!(text.contains("cargo xtask page"), "{text}");
        assert!(std::env::var_os("CI").is_none(), "in CI: {text}");
        eprintln!("NOT TESTED: {text}");
        return;
    }
    assert_eq!(status, "200");
    let Ok(browser) = Browser::find() else {
        assert!(std::env::var_os("CI").is_none(), "in CI: no browser");
        eprintln!("NOT TESTED: no browser; `apt-get install chromium`, and again");
        return;
    };
    // The least that a diagnosis takes is 600; the simulated board falls behind on a busy computer.
    for _ in 0..90 {
        if monitor.snapshot()["samples"].as_u64().unwrap() > 640 {
            break;
        }
        std::thread::sleep(Duration::from_secs(1));
    }
    let path = format!("/record.csv?token={}", monitor.token);
    let (status, record) = get(&path, &host);
    assert_eq!(status, "200");
    let own = between(&monitor, &record);
    let beside = folder("engine_page").join("page");
    let address = format!("http://127.0.0.1:{own}/engine");
    let (dom, console) = browser.dom_of(&address, &beside).expect("it shows a page");
    let seen = answer_of(&dom, &console);
    assert_eq!(seen["wrong"], serde_json::json!([]), "{seen}\n{console}");
    assert_eq!(seen["requests"], serde_json::json!([]), "{seen}");
    assert_eq!(seen["file"], "record.csv", "{seen}");
    assert!(seen["report"].as_u64().unwrap_or(0) > 10_000, "{seen}");
}

#[test]
fn the_page_shows_what_is_measured_and_turns_the_motor_after_a_question() {
    let browser = match Browser::find() {
        Ok(browser) => browser,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "in CI: {error}");
            eprintln!("NOT TESTED: {error}; `apt-get install chromium`, and again");
            return;
        }
    };
    let board = Board::start();
    let monitor = Monitor::start(&board);
    let own = between(&monitor, "");
    let address = format!("http://127.0.0.1:{own}/#{}", monitor.token);
    let beside = folder("live_page").join("page");
    let (dom, console) = browser.dom_of(&address, &beside).expect("it shows a page");
    let seen = answer_of(&dom, &console);
    assert_eq!(seen["wrong"], serde_json::json!([]), "{seen}\n{console}");
    let complaints: Vec<&str> = console
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    assert_eq!(seen["requests"], serde_json::json!([]));
    let text = |key: &str| seen[key].as_str().unwrap_or_default().to_owned();
    assert!(
        text("figures").contains("0 missing (board 0, line 0)")
            && text("figures").contains("supply 5.0"),
        "{seen}"
    );
    // Three curves and their bands; three courses.
    assert_eq!(
        (&seen["curves"], &seen["rates"]),
        (&Value::from(6), &Value::from(3)),
        "{seen}"
    );
    assert_eq!(seen["filled"], 0, "a curve is a line: {seen}");
    assert!(seen["wide"].as_i64().unwrap() <= 0, "{seen}");
    assert!(
        text("question").contains("Turn the motor at 60 of 255?"),
        "{seen}"
    );
    assert_eq!(seen["unconfirmed"], 0, "No was the answer");
    assert!(seen["turned"].as_i64().unwrap() > 0, "{seen}");
    // Some seconds of a sensor are enough for the report, or it says that they are not.
    let reported =
        seen["report"].as_u64().unwrap() > 10_000 || text("working").contains("let it record");
    assert!(reported, "{seen}");
}
