//! docs/effects.md, made of what every effect says about itself.

use std::fmt::Write as _;

use crate::effects::EFFECTS;

/// The text of docs/effects.md.
#[must_use]
pub fn effects_markdown() -> String {
    let mut out = String::from(
        "# The effects\n\n\
         Made of `crates/model/src/effects/`, one file each; `RENEW=1 cargo test -p model --test effects_page` renews it.\n\
         A further effect is one more file there and one more line in `mod.rs`.\n\n\
         | cause | effect |\n|---|---|\n",
    );
    for e in EFFECTS {
        let _ = writeln!(out, "| [`{0}`](#{0}) | {1} |", e.id(), e.docs().title);
    }
    for e in EFFECTS {
        let docs = e.docs();
        let _ = write!(
            out,
            "\n## {}\n\n{}.\n\n{}\n\n| parameter | unit | meaning |\n|---|---|---|\n",
            e.id(),
            docs.title,
            docs.physics
        );
        for p in e.parameters() {
            let meaning = if p.required {
                p.meaning.to_owned()
            } else {
                format!("{} (may be left out)", p.meaning)
            };
            let _ = writeln!(out, "| `{}` | {} | {meaning} |", p.name, p.unit);
        }
        let _ = write!(
            out,
            "\n- Needs: {}\n- Test: {}\n- Figure: {}\n",
            docs.excitation, docs.test, docs.figure
        );
        for r in e.rivals() {
            let _ = writeln!(out, "- Not `{}`? {}.", r.cause, r.experiment);
        }
    }
    out
}
