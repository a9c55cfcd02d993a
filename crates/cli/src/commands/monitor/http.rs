//! As much of HTTP/1.1 as a page on this computer needs: one request and one answer over a connection, small and bounded.

use std::io::{BufRead, BufReader, Read, Result, Write};
use std::net::TcpStream;
use std::time::Duration;

/// How long a request may take to come, and an answer to go.
const WAIT: Duration = Duration::from_secs(5);
/// Bytes of a request's head, and of its body.
const HEAD: u64 = 8 << 10;
const BODY: usize = 1 << 10;

/// A request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Request {
    pub method: String,
    /// Without what is behind the question mark.
    pub path: String,
    /// That.
    pub query: String,
    /// Names in small letters.
    pub headers: Vec<(String, String)>,
    pub body: String,
}

impl Request {
    /// Reads one; `None` where it is none.
    pub fn read(stream: &TcpStream) -> Result<Option<Self>> {
        stream.set_read_timeout(Some(WAIT))?;
        stream.set_write_timeout(Some(WAIT))?;
        Self::parse(BufReader::new(stream))
    }

    fn parse(mut stream: impl BufRead) -> Result<Option<Self>> {
        let mut head = Vec::new();
        let mut lines = stream.by_ref().take(HEAD);
        loop {
            let mut line = Vec::new();
            if lines.read_until(b'\n', &mut line)? == 0 || !line.ends_with(b"\n") {
                return Ok(None);
            }
            let Ok(line) = String::from_utf8(line) else {
                return Ok(None);
            };
            let line = line.trim_end();
            if line.is_empty() && !head.is_empty() {
                break;
            }
            head.push(line.to_owned());
        }
        let mut head = head.iter();
        let first = head.next().map_or("", String::as_str);
        let mut words = first.split(' ');
        let (Some(method), Some(target), Some("HTTP/1.1" | "HTTP/1.0"), None) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            return Ok(None);
        };
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let headers: Vec<(String, String)> = head
            .filter_map(|line| line.split_once(':'))
            .map(|(name, value)| (name.to_ascii_lowercase(), value.trim().to_owned()))
            .collect();
        let mut request = Self {
            method: method.to_owned(),
            path: path.to_owned(),
            query: query.to_owned(),
            headers,
            body: String::new(),
        };
        let length = request.header("content-length").unwrap_or("0").parse();
        let Ok(length @ 0..=BODY) = length else {
            return Ok(None);
        };
        let mut body = vec![0; length];
        stream.read_exact(&mut body)?;
        let Ok(body) = String::from_utf8(body) else {
            return Ok(None);
        };
        request.body = body;
        Ok(Some(request))
    }

    /// A header, by its name in small letters; `None` where it is missing or there are several.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut all = self.headers.iter().filter(|(n, _)| n == name);
        let (_, value) = all.next()?;
        all.next().is_none().then_some(value)
    }
}

/// What nothing of another site may do with an answer of ours.
const GUARD: &str = "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\n\
                     Cross-Origin-Resource-Policy: same-origin\r\nX-Frame-Options: DENY\r\n";

/// Sends an answer, and closes.
pub(super) fn answer(
    mut stream: &TcpStream,
    status: &str,
    kind: &str,
    more: &str,
    body: &[u8],
) -> Result<()> {
    let length = body.len();
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n{GUARD}{more}\r\n"
    )?;
    stream.write_all(body)?;
    stream.flush()
}

/// Begins an answer of events.
pub(super) fn events(mut stream: &TcpStream) -> Result<()> {
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n{GUARD}\r\n"
    )?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Option<Request> {
        Request::parse(text.as_bytes()).ok().flatten()
    }

    #[test]
    fn a_request_is_read_and_what_is_none_is_refused() {
        let got = parse("POST /act?token=1 HTTP/1.1\r\nHost: a\r\nContent-Length: 4\r\n\r\nstop")
            .unwrap();
        assert_eq!(
            (&*got.method, &*got.path, &*got.query),
            ("POST", "/act", "token=1")
        );
        assert_eq!((got.header("host"), &*got.body), (Some("a"), "stop"));
        for wrong in [
            "",
            "\r\n\r\n",
            "GET /\r\n\r\n",
            "GET / HTTP/1.1 more\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\n",
            "POST / HTTP/1.1\r\nContent-Length: 9999\r\n\r\n",
            "POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
            "POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nabc",
        ] {
            assert_eq!(parse(wrong), None, "{wrong:?}");
        }
        assert_eq!(
            parse(&format!(
                "GET / HTTP/1.1\r\nA: {}\r\n\r\n",
                "b".repeat(9000)
            )),
            None
        );
        let twice = parse("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n").unwrap();
        assert_eq!(
            twice.header("host"),
            None,
            "which of them counts is not known"
        );
    }
}
