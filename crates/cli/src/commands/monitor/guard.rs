//! Who may see the page, and who may turn the motor: only whoever was told the address, from the page itself.
//!
//! | what could be | what keeps it off |
//! |---|---|
//! | another computer | the server listens at 127.0.0.1 alone |
//! | another user of this computer | everything but the bare page needs the token, which is printed with the address, behind a `#`: no browser sends that |
//! | a web site in the same browser | commands are POST, with the token in a header that only the page's own script can send, and `Origin` has to be the page's |
//! | a web site whose name is made to mean 127.0.0.1 | `Host` has to be 127.0.0.1 or localhost, with our port |

use std::hash::{BuildHasher, Hasher, RandomState};

use super::http::Request;

/// Header with the token.
pub(super) const TOKEN: &str = "x-imu-stand-token";

/// Knows the token and the port.
pub(super) struct Guard {
    pub token: String,
    pub port: u16,
}

/// What a request is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum For {
    /// The page, the same for everybody.
    Page,
    /// What was measured.
    Looking,
    /// Something that the program or the board is to do.
    Acting,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refused {
    /// Not asked of this computer by its own name.
    Host,
    /// By a page that is not ours.
    Origin,
    /// Without the token.
    Token,
    /// A command that is no POST.
    Method,
}

impl Guard {
    /// With a new token.
    pub fn new(port: u16) -> Self {
        // The standard library's hash is keyed by the system's random numbers, 128 bits of them.
        let keyed = RandomState::new();
        let half = |k: u64| {
            let mut hasher = keyed.build_hasher();
            hasher.write_u64(k);
            hasher.finish()
        };
        Self {
            token: format!("{:016x}{:016x}", half(1), half(2)),
            port,
        }
    }

    /// The address, with the token.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/#{}", self.port, self.token)
    }

    /// Whether a request may have what it is for.
    pub fn check(&self, request: &Request, purpose: For) -> Result<(), Refused> {
        let acts = purpose == For::Acting;
        let ours = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let is_ours = |host: &str| ours.iter().any(|our| our == host);
        if !request.header("host").is_some_and(is_ours) {
            return Err(Refused::Host);
        }
        let is_own = |origin: &str| origin.strip_prefix("http://").is_some_and(is_ours);
        // What is only looked at has none.
        if request
            .header("origin")
            .map_or(acts, |origin| !is_own(origin))
        {
            return Err(Refused::Origin);
        }
        let told = request.header(TOKEN);
        let told = told.or_else(|| request.query.strip_prefix("token=").filter(|_| !acts));
        if purpose != For::Page && told != Some(&*self.token) {
            return Err(Refused::Token);
        }
        if acts != (request.method == "POST") {
            return Err(Refused::Method);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(method: &str, query: &str, headers: &[(&str, &str)]) -> Request {
        let headers = headers
            .iter()
            .map(|(n, v)| ((*n).to_owned(), (*v).to_owned()));
        Request {
            method: method.to_owned(),
            query: query.to_owned(),
            headers: headers.collect(),
            ..Request::default()
        }
    }

    #[test]
    fn only_the_page_itself_commands_and_only_who_was_told_looks() {
        let guard = Guard::new(8090);
        assert_ne!(guard.token, Guard::new(8090).token);
        assert_eq!(guard.token.len(), 32);
        let (host, own) = (
            ("host", "127.0.0.1:8090"),
            ("origin", "http://127.0.0.1:8090"),
        );
        let token = (TOKEN, &*guard.token);
        let query = format!("token={}", guard.token);
        let looks = |headers: &[_]| guard.check(&request("GET", &query, headers), For::Looking);
        assert_eq!(looks(&[host]), Ok(()));
        assert_eq!(looks(&[("host", "localhost:8090")]), Ok(()));
        assert_eq!(looks(&[("host", "evil.example:8090")]), Err(Refused::Host));
        assert_eq!(looks(&[("host", "127.0.0.1:8091")]), Err(Refused::Host));
        assert_eq!(looks(&[]), Err(Refused::Host));
        assert_eq!(
            looks(&[host, ("origin", "http://evil.example")]),
            Err(Refused::Origin)
        );
        let nobody = guard.check(&request("GET", "token=0", &[host]), For::Looking);
        assert_eq!(nobody, Err(Refused::Token));
        let bare = |headers: &[_]| guard.check(&request("GET", "", headers), For::Page);
        assert_eq!(bare(&[host]), Ok(()));
        assert_eq!(bare(&[("host", "evil.example")]), Err(Refused::Host));

        let acts = |method, query, headers: &[_]| {
            guard.check(&request(method, query, headers), For::Acting)
        };
        assert_eq!(acts("POST", "", &[host, own, token]), Ok(()));
        assert_eq!(acts("GET", "", &[host, own, token]), Err(Refused::Method));
        assert_eq!(acts("POST", "", &[host, token]), Err(Refused::Origin));
        assert_eq!(
            acts("POST", "", &[host, ("origin", "null"), token]),
            Err(Refused::Origin)
        );
        // A form of another site can send a query, and no header.
        assert_eq!(acts("POST", &query, &[host, own]), Err(Refused::Token));
        assert_eq!(
            acts("POST", "", &[host, own, (TOKEN, "")]),
            Err(Refused::Token)
        );
    }
}
