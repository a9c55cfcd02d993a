//! docs/effects.md says what the effects say.

#[test]
fn golden_effects_page() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/effects.md");
    let text = model::docs::effects_markdown();
    if std::env::var_os("RENEW").is_some() {
        std::fs::write(path, &text).expect("docs/effects.md");
    }
    let page = std::fs::read_to_string(path).expect("docs/effects.md");
    assert_eq!(
        page, text,
        "docs/effects.md is old: RENEW=1 cargo test -p model --test effects_page"
    );
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
