//! Readers of other people's formats, on files that may be damaged anywhere: where one of them panics, that is an error of the
//! file, and says so like any other.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use super::error::brief;

thread_local! {
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// What `read` gives, or why it could not go on. It must own what it changes, as all of it is dropped then.
pub(super) fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            if !IS_GUARDED.get() {
                usual(panic);
            }
        }));
    });
    let before = IS_GUARDED.replace(true);
    let done = catch_unwind(AssertUnwindSafe(read));
    IS_GUARDED.set(before);
    done.unwrap_or_else(|panic| {
        Err(format!(
            "it is damaged: its reader stopped with `{}`; copy or export it again",
            brief(said(&*panic))
        ))
    })
}

fn said(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    let owned = panic.downcast_ref::<String>().map(String::as_str);
    text.or(owned).unwrap_or("no word")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_that_panics_is_an_error_of_the_file() {
        assert_eq!(guarded(|| Ok(3)), Ok(3));
        assert_eq!(
            guarded::<()>(|| Err("why".to_owned())),
            Err("why".to_owned())
        );
        let broken = guarded::<()>(|| panic!("no dictionary {}", 3)).expect_err("it panics");
        assert!(
            broken.contains("damaged") && broken.contains("no dictionary 3"),
            "{broken}"
        );
    }
}
