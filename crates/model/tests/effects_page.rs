//! docs/effects.md says what the effects say.

#[test]
fn golden_effects_page() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/effects.md");
    let text = model::docs::effects_markdown();
    let page = std::fs::read_to_string(path).expect("docs/effects.md");
    assert_eq!(page, text, "docs/effects.md is old: cargo xtask effects");
}

#[test]
fn every_example_is_a_model_file_and_names_what_its_effect_needs() {
    for e in model::effects::EFFECTS {
        let example = model::docs::example(*e, true);
        // The file refuses unknown settings and parameters, and asks for those that are required.
        let read = model::ModelFile::parse(&example.to_toml())
            .unwrap_or_else(|error| panic!("{}: {error}", e.id()));
        assert_eq!(read.effects, example.effects, "{}", e.id());
    }
}

#[test]
fn every_setting_is_on_the_page_of_the_model_file() {
    let page = include_str!("../../../docs/model-file.md");
    for s in model::excitation::SETTINGS {
        assert!(
            page.contains(&format!(
                "| `{}` | {:.1} | {} |",
                s.key, s.default, s.meaning
            )),
            "{}",
            s.key
        );
    }
}

#[test]
fn the_example_on_the_page_is_a_model_file() {
    let page = include_str!("../../../docs/model-file.md");
    let example = page
        .split("```toml")
        .nth(1)
        .and_then(|s| s.split("```").next())
        .expect("an example");
    let model = model::ModelFile::parse(example).expect("a model file");
    assert_eq!(model.effects[0].cause, "temperature");
}
