//! The page that runs the engine in the browser (crates/web), where it has been built.

use std::path::{Path, PathBuf};

/// Names the file where it lies elsewhere than beside the program.
const VARIABLE: &str = "IMU_STAND_PAGE";
/// Where `cargo xtask page` puts it, from the repository; the program is in target/release.
const BUILT: &str = "target/page/index.html";

fn places() -> Vec<PathBuf> {
    let named = std::env::var_os(VARIABLE).map(PathBuf::from);
    let own = std::env::current_exe().unwrap_or_default();
    let beside = own.parent().and_then(Path::parent);
    let beside = beside.map(|target| target.join("page/index.html"));
    named
        .into_iter()
        .chain(beside)
        .chain([BUILT.into()])
        .collect()
}

/// The page.
///
/// # Errors
/// What to do where it is not there.
pub(super) fn page() -> Result<Vec<u8>, String> {
    let found = places().iter().find_map(|path| std::fs::read(path).ok());
    found.ok_or_else(|| {
        format!(
            "The page that runs the engine in the browser has not been built. In the repository `cargo xtask page` makes {BUILT}; \
             {VARIABLE}=FILE names it where it lies elsewhere. \"Diagnose\" on the page before works without it."
        )
    })
}
