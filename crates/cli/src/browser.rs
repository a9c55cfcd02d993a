//! A browser without a window, which prints a report as PDF and in which its tests look at it.

use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Names the browser where it has another name or place.
pub const VARIABLE: &str = "IMU_STAND_CHROMIUM";

/// What Chromium and its kin are called.
const NAMES: [&str; 7] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
];

/// Where they are on systems whose programs are not found by name.
const PLACES: [&str; 5] = [
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
];

/// A page of ours takes a second; on a busy machine some more.
const AT_MOST: Duration = Duration::from_secs(120);
/// Between two looks at whether it has ended.
const PAUSE: Duration = Duration::from_millis(50);

/// Why a page was not printed.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[non_exhaustive]
pub enum BrowserError {
    /// None is installed.
    #[error("no Chromium is found, which prints reports and draws figures as PNG")]
    #[diagnostic(
        code(browser::none),
        help(
            "install it (Debian: `apt-get install chromium`; Chrome and Edge do as well), or name it by the environment's \
             IMU_STAND_CHROMIUM; or open the report in any browser and print it to a file"
        )
    )]
    None,
    /// It did not do it.
    #[error("{} did not print the report: {why}", path.display())]
    #[diagnostic(
        code(browser::failed),
        help(
            "open the report in a browser and print it to a file; IMU_STAND_CHROMIUM names another one"
        )
    )]
    Failed {
        /// Which one.
        path: PathBuf,
        /// What happened.
        why: String,
    },
    /// A file is in the way.
    #[error("cannot write {}: {source}", path.display())]
    #[diagnostic(
        code(browser::io),
        help("name a file where you may write, on a disk with room")
    )]
    Io {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// A Chromium that was found.
#[derive(Clone, Debug)]
pub struct Browser {
    path: PathBuf,
    at_most: Duration,
}

impl Browser {
    /// The one that the environment names, else the first that is installed.
    ///
    /// # Errors
    /// [`BrowserError::None`].
    pub fn find() -> Result<Self, BrowserError> {
        let named = std::env::var_os(VARIABLE).map(PathBuf::from);
        if let Some(path) = named {
            let is_there = path.is_file();
            return is_there.then(|| Self::at(path)).ok_or(BrowserError::None);
        }
        let folders = std::env::var_os("PATH").unwrap_or_default();
        let by_name =
            std::env::split_paths(&folders).flat_map(|folder| NAMES.map(|name| folder.join(name)));
        let mut all = by_name.chain(PLACES.map(PathBuf::from));
        let path = all.find(|path| path.is_file());
        path.map(Self::at).ok_or(BrowserError::None)
    }

    fn at(path: PathBuf) -> Self {
        let at_most = AT_MOST;
        Self { path, at_most }
    }

    /// The same for a page that computes longer.
    #[must_use]
    pub fn patient(self, at_most: Duration) -> Self {
        Self { at_most, ..self }
    }

    /// Its place.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// It, without window, network services and traces, with a profile of its own. It shows pages of this program alone,
    /// which have no script: the sandbox, which is refused to the root of a container, keeps nothing out.
    fn command(&self, profile: &Path) -> Command {
        let mut command = Command::new(&self.path);
        command
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--disable-dev-shm-usage",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdin(Stdio::null());
        command
    }

    /// Prints a page as PDF.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn print(&self, page: &str, pdf: &Path) -> Result<(), BrowserError> {
        let folder = Folder::beside(pdf)?;
        let printed = folder.0.join("report.pdf");
        let mut command = self.command(&folder.0.join("profile"));
        command
            .arg("--no-pdf-header-footer")
            .arg(format!("--print-to-pdf={}", printed.display()));
        self.open(command, page, &folder)?;
        self.taken(&printed, b"%PDF-", pdf)
    }

    /// Puts what it wrote where it belongs, if it begins as it should.
    fn taken(&self, made: &Path, magic: &[u8; 5], to: &Path) -> Result<(), BrowserError> {
        let mut start = [0; 5];
        let is_it = std::fs::File::open(made)
            .and_then(|mut file| file.read_exact(&mut start))
            .is_ok_and(|()| &start == magic);
        if !is_it {
            return Err(self.failed("it ended without a file"));
        }
        std::fs::copy(made, to).map_err(|source| BrowserError::Io {
            path: to.to_owned(),
            source,
        })?;
        Ok(())
    }

    /// Draws a page of a size, in two dots a unit, as PNG.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn draw(&self, page: &str, size: (u32, u32), png: &Path) -> Result<(), BrowserError> {
        let folder = Folder::beside(png)?;
        let drawn = folder.0.join("figure.png");
        let mut command = self.command(&folder.0.join("profile"));
        command
            .args(["--hide-scrollbars", "--force-device-scale-factor=2"])
            .arg(format!("--window-size={},{}", size.0, size.1))
            .arg(format!("--screenshot={}", drawn.display()));
        self.open(command, page, &folder)?;
        self.taken(&drawn, b"\x89PNG\r", png)
    }

    /// A page as it is after its scripts have run, and what it said to the console.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn dom(&self, page: &str, beside: &Path) -> Result<(String, String), BrowserError> {
        let folder = Folder::beside(beside)?;
        let mut command = self.command(&folder.0.join("profile"));
        command.args([
            "--dump-dom",
            "--enable-logging=stderr",
            "--window-size=1400,900",
        ]);
        self.open(command, page, &folder)
    }

    /// The same of a page that this computer serves.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn dom_of(&self, address: &str, beside: &Path) -> Result<(String, String), BrowserError> {
        let folder = Folder::beside(beside)?;
        let mut command = self.command(&folder.0.join("profile"));
        command.args([
            "--dump-dom",
            "--enable-logging=stderr",
            "--window-size=1400,900",
            address,
        ]);
        self.ended(command, &folder)
    }

    fn failed(&self, why: &str) -> BrowserError {
        BrowserError::Failed {
            path: self.path.clone(),
            why: why.to_owned(),
        }
    }

    /// Opens a page, and waits until it has ended.
    fn open(
        &self,
        mut command: Command,
        page: &str,
        folder: &Folder,
    ) -> Result<(String, String), BrowserError> {
        let file = folder.0.join("report.html");
        let written = std::fs::File::create(&file).and_then(|mut f| f.write_all(page.as_bytes()));
        written.map_err(|source| BrowserError::Io {
            path: file.clone(),
            source,
        })?;
        command.arg(&file);
        self.ended(command, folder)
    }

    /// Runs it, and waits until it has ended: what it printed, both ways.
    fn ended(
        &self,
        mut command: Command,
        folder: &Folder,
    ) -> Result<(String, String), BrowserError> {
        let out = [folder.0.join("out"), folder.0.join("err")];
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| BrowserError::Io { path, source }
        };
        // Into files: a pipe that nobody empties would stop it.
        let stdout = std::fs::File::create(&out[0]).map_err(io(&out[0]))?;
        let stderr = std::fs::File::create(&out[1]).map_err(io(&out[1]))?;
        let child = command
            .stdout(stdout)
            .stderr(stderr)
            .spawn()
            .map_err(|error| self.failed(&error.to_string()))?;
        let ended = waited(child, self.at_most);
        let [said, errors] = out.map(|path| {
            let bytes = std::fs::read(path).unwrap_or_default();
            String::from_utf8_lossy(&bytes).into_owned()
        });
        match ended {
            Some(true) => Ok((said, errors)),
            Some(false) => Err(self.failed(errors.lines().last().unwrap_or("it failed"))),
            None => Err(self.failed("it did not end")),
        }
    }
}

/// Whether it succeeded; nothing where it took too long, and was ended.
fn waited(mut child: Child, at_most: Duration) -> Option<bool> {
    let begin = Instant::now();
    while begin.elapsed() < at_most {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.success()),
            Ok(None) => std::thread::sleep(PAUSE),
            Err(_) => return Some(false),
        }
    }
    // Where it cannot be ended it has ended.
    child.kill().ok();
    child.wait().ok();
    None
}

/// A folder for what a browser needs, gone afterwards. It lies beside the result: a browser in a snap sees no other.
struct Folder(PathBuf);

impl Folder {
    fn beside(file: &Path) -> Result<Self, BrowserError> {
        let folder = file.parent().filter(|f| !f.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let own = COUNT.fetch_add(1, Ordering::Relaxed);
        let made = std::path::absolute(folder).and_then(|folder| {
            let path = folder.join(format!("imu-stand-print-{}-{own}", std::process::id()));
            std::fs::create_dir_all(&path).map(|()| path)
        });
        made.map(Self).map_err(|source| BrowserError::Io {
            path: folder.to_owned(),
            source,
        })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What it leaves behind is no reason to fail.
        std::fs::remove_dir_all(&self.0).ok();
    }
}
