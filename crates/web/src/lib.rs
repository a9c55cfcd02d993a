//! The engine of `imu-stand` for a page in a browser: a file comes as bytes, what is done with it as JSON, and so do the
//! answers. The page (`page/`) runs it in a worker; `cargo xtask page` puts both into one file.

mod session;
#[cfg(target_arch = "wasm32")]
mod wasm;

pub use session::Session;
