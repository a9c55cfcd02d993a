//! The page that runs the engine in a browser: `target/page/index.html`, one file with everything in it.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Crates, Failure, Pace, run, watched};
use crate::{cargo, toolchain};

/// What the engine is compiled for. For `wasm32-unknown-unknown` plotters measures letters by the page's fonts, which a worker does
/// not have; here it estimates them as on any other system, and the figures are the program's.
const TARGET: &str = "wasm32-wasip1";

/// Builds the page; says where it is and how large.
///
/// # Errors
/// Where the target is missing and cannot be installed, or the build fails.
pub fn page(root: &Path) -> Result<String, Failure> {
    target()?;
    // A folder of its own: crates there have other features than those of the tests.
    let folder = root.join("target/web");
    let mut build = cargo(root, &["rustc", "--release", "--locked"]);
    build
        .args([
            "--package",
            "imu-stand-web",
            "--lib",
            "--crate-type",
            "cdylib",
        ])
        .args(["--target", TARGET])
        .arg("--target-dir")
        .arg(&folder)
        // Names of functions, which nobody sees there.
        .args(["--", "-C", "strip=symbols"]);
    watched(
        "the page",
        &mut build,
        &mut Crates::default(),
        &mut Pace::Steady,
    )?;
    let engine = folder.join(TARGET).join("release/imu_stand_web.wasm");
    let bytes = std::fs::read(&engine).map_err(|error| cannot(&engine, &error))?;
    let part = |name: &str| {
        let path = root.join("crates/web/page").join(name);
        std::fs::read_to_string(&path).map_err(|error| cannot(&path, &error))
    };
    // The engine last: nothing is looked for in it.
    let html = (part("index.html")?)
        .replacen(">PAGE<", &format!(">\n{}<", part("page.js")?), 1)
        .replacen(">WORKER<", &format!(">\n{}<", part("worker.js")?), 1)
        .replacen(">ENGINE<", &format!(">{}<", base64(&bytes)), 1);
    let out: PathBuf = root.join("target/page/index.html");
    let parent = root.join("target/page");
    std::fs::create_dir_all(&parent).map_err(|error| cannot(&parent, &error))?;
    std::fs::write(&out, &html).map_err(|error| cannot(&out, &error))?;
    Ok(format!(
        "target/page/index.html of {:.1} MB, its engine of {:.1} MB",
        html.len() as f64 / 1e6,
        bytes.len() as f64 / 1e6
    ))
}

/// Has rustup install the target where it is missing.
fn target() -> Result<(), Failure> {
    let has_it = || {
        let mut rustc = Command::new("rustc");
        rustc.args(["--print", "target-libdir", "--target", TARGET]);
        let folder = rustc.output().ok().filter(|said| said.status.success());
        folder.is_some_and(|said| Path::new(String::from_utf8_lossy(&said.stdout).trim()).is_dir())
    };
    if has_it() {
        return Ok(());
    }
    let by_hand = || {
        Failure::new(
            &format!("Rust's library for {TARGET} is missing, which the page is built with"),
            &format!(
                "`rustup target add {TARGET}`; without rustup install it by your system's packages"
            ),
        )
    };
    if !toolchain::has("rustup") {
        return Err(by_hand());
    }
    println!("installing Rust's library for {TARGET} (rustup)");
    let mut rustup = Command::new("rustup");
    rustup.args(["target", "add", TARGET]);
    run("rustup", &mut rustup).map_err(|failure| {
        eprintln!("{failure}");
        by_hand()
    })
}

fn cannot(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(
        &format!("{}: {error}", path.display()),
        "is it there, and is there room?",
    )
}

/// Bytes as text: RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let of = |k: usize| u32::from(three.get(k).copied().unwrap_or(0));
        let bits = of(0) << 16 | of(1) << 8 | of(2);
        for k in 0..4 {
            out.push(if k <= three.len() {
                char::from(LETTERS[(bits >> (18 - 6 * k)) as usize & 63])
            } else {
                '='
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn base64_is_that_of_the_rfc() {
        // RFC 4648, section 10.
        for (text, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(super::base64(text.as_bytes()), coded);
        }
    }
}
