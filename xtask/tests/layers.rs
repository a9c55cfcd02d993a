//! The layers of the engine: no `use` line and no qualified path of `crates/diagnosis` points to a layer above its own, no
//! modules of an engine's crate know each other but a parent and its private children, and `noise` and `diagnosis` stand side
//! by side on `model` and `numerics`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The layers of `crates/diagnosis`, each of which may use those before it.
const LAYERS: [&str; 15] = [
    "result",
    "test_level",
    "fit",
    "ingest",
    "audit",
    "features",
    "search",
    "two_level",
    "joint",
    "criticise",
    "attribute",
    "unnamed",
    "report",
    "replicates",
    "pipeline",
];

/// Modules by path, with the text of each: without comments, strings and tests.
type Sources = BTreeMap<Vec<String>, String>;
/// Which module names which.
type Arrows = BTreeSet<(Vec<String>, Vec<String>)>;

/// The text without line comments and what stands between quotes.
fn code(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut quoted = false;
        let mut before = ' ';
        for (i, c) in line.char_indices() {
            if !quoted && line[i..].starts_with("//") {
                break;
            }
            if c == '"' && before != '\\' && before != '\'' {
                quoted = !quoted;
            } else if !quoted {
                out.push(c);
            }
            before = if before == '\\' { ' ' } else { c };
        }
        out.push('\n');
    }
    // Tests stand last in a file and may look anywhere.
    match out.find("#[cfg(test)]\nmod tests {") {
        Some(at) => out[..at].to_owned(),
        None => out,
    }
}

fn sources(folder: &Path, module: &[String], all: &mut Sources) {
    for entry in std::fs::read_dir(folder).expect("a folder of the engine") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().and_then(|n| n.to_str()).expect("a name");
        let mut own = module.to_vec();
        if path.is_dir() {
            own.push(name.to_owned());
            sources(&path, &own, all);
            continue;
        }
        if name == "lib" || name.ends_with("tests") {
            continue;
        }
        if name != "mod" {
            own.push(name.to_owned());
        }
        let text = std::fs::read_to_string(&path).expect("a source file");
        all.insert(own, code(&text));
    }
}

/// The paths of a `use` tree.
fn leaves(tree: &str, prefix: &[String], all: &mut Vec<Vec<String>>) {
    let (mut depth, mut from) = (0, 0);
    let mut parts = vec![];
    for (i, c) in tree.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[from..i]);
                from = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[from..]);
    for part in parts.into_iter().map(str::trim).filter(|p| !p.is_empty()) {
        let (path, group) = match part.split_once('{') {
            Some((path, rest)) => (path, rest.rsplit_once('}').map(|(inner, _)| inner)),
            None => (part, None),
        };
        let path = path.split(" as ").next().unwrap_or(path);
        let mut own = prefix.to_vec();
        let segments = path.split("::").map(str::trim);
        own.extend(segments.filter(|s| !s.is_empty()).map(str::to_owned));
        match group {
            Some(inner) => leaves(inner, &own, all),
            None => all.push(own),
        }
    }
}

/// A path from the root of the crate, where it begins with `crate`, `super` or `self`.
fn absolute(path: &[String], module: &[String]) -> Option<Vec<String>> {
    let up = path.iter().take_while(|s| *s == "super").count();
    match path.first()?.as_str() {
        "crate" => Some(path[1..].to_vec()),
        "self" => Some([module, &path[1..]].concat()),
        "super" => Some([&module[..module.len().checked_sub(up)?], &path[up..]].concat()),
        _ => None,
    }
}

/// All paths that a module names: of its `use` lines, qualified ones, and those that begin with a module it uses or declares.
fn paths(module: &[String], text: &str, sources: &Sources) -> Vec<Vec<String>> {
    let mut named = vec![];
    let mut short: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut rest = String::new();
    for statement in text.split_inclusive(';') {
        let at = statement
            .rfind("use ")
            .filter(|at| statement[..*at].ends_with(char::is_whitespace) || *at == 0);
        let Some(at) = at else {
            rest.push_str(statement);
            continue;
        };
        rest.push_str(&statement[..at]);
        let mut all = vec![];
        leaves(statement[at + 4..].trim_end_matches(';'), &[], &mut all);
        for mut path in all.iter().filter_map(|p| absolute(p, module)) {
            if path.last().is_some_and(|s| s == "self") {
                path.pop();
            }
            if let Some(last) = path.last() {
                short.insert(last.clone(), path.clone());
            }
            named.push(path);
        }
    }
    let plain = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for word in rest.split(|c: char| !plain(c)).filter(|w| w.contains("::")) {
        let path: Vec<String> = word.split("::").map(str::to_owned).collect();
        let child = [module, &path[..1]].concat();
        if let Some(path) = absolute(&path, module) {
            named.push(path);
        } else if let Some(known) = short.get(&path[0]).filter(|k| sources.contains_key(*k)) {
            named.push([known.as_slice(), &path[1..]].concat());
        } else if sources.contains_key(&child) {
            named.push(child);
        }
    }
    named
}

fn arrows(sources: &Sources) -> Arrows {
    let mut all = Arrows::new();
    for (module, text) in sources {
        for path in paths(module, text, sources) {
            let lengths = (1..=path.len()).rev();
            let target = lengths
                .map(|n| path[..n].to_vec())
                .find(|p| sources.contains_key(p));
            if let Some(target) = target.filter(|t| t != module) {
                all.insert((module.clone(), target));
            }
        }
    }
    all
}

fn folder(name: &str) -> PathBuf {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    crates.join(name)
}

fn of_crate(name: &str) -> Sources {
    let mut all = Sources::new();
    sources(&folder(name).join("src"), &[], &mut all);
    all
}

fn upward(arrows: &Arrows) -> Vec<String> {
    let layer = |m: &[String]| LAYERS.iter().position(|l| *l == m[0]);
    let up = |(from, to): &&(Vec<String>, Vec<String>)| layer(to) > layer(from);
    let told = |(from, to): &(Vec<String>, Vec<String>)| {
        format!("{} -> {}", from.join("::"), to.join("::"))
    };
    arrows.iter().filter(up).map(told).collect()
}

/// Modules that reach themselves, arrows between a parent and its children left out.
fn circular(arrows: &Arrows) -> Vec<String> {
    let related = |a: &[String], b: &[String]| a.starts_with(b) || b.starts_with(a);
    let apart: Vec<_> = arrows.iter().filter(|(a, b)| !related(a, b)).collect();
    let reached = |from: &Vec<String>| {
        let mut seen: BTreeSet<&Vec<String>> = BTreeSet::new();
        let mut open = vec![from];
        while let Some(at) = open.pop() {
            for (_, to) in apart.iter().filter(|(a, _)| a == at) {
                if seen.insert(to) {
                    open.push(to);
                }
            }
        }
        seen.contains(from)
    };
    let modules: BTreeSet<&Vec<String>> = apart.iter().map(|(a, _)| a).collect();
    let circular = modules.into_iter().filter(|m| reached(m));
    circular.map(|m| m.join("::")).collect()
}

#[test]
fn no_module_of_the_diagnosis_uses_a_layer_above_its_own() {
    let sources = of_crate("diagnosis");
    let unknown: Vec<_> = sources
        .keys()
        .filter(|m| !LAYERS.contains(&m[0].as_str()))
        .collect();
    assert!(unknown.is_empty(), "of no layer: {unknown:?}");
    let arrows = arrows(&sources);
    assert!(arrows.len() > 200, "{} arrows are read", arrows.len());
    assert_eq!(upward(&arrows), Vec::<String>::new());
}

#[test]
fn no_modules_of_the_engine_know_each_other_but_parent_and_child() {
    for name in ["numerics", "noise", "diagnosis"] {
        let found = circular(&arrows(&of_crate(name)));
        assert_eq!(found, Vec::<String>::new(), "crates/{name}");
    }
}

#[test]
fn the_crates_of_the_engine_use_only_what_stands_below() {
    let ours = ["numerics", "model", "noise", "diagnosis", "bench", "wire"];
    for (name, below) in [
        ("numerics", &[][..]),
        ("model", &[]),
        ("noise", &["model", "numerics"]),
        ("diagnosis", &["model", "numerics"]),
        ("bench", &["wire"]),
    ] {
        let text = std::fs::read_to_string(folder(name).join("Cargo.toml")).expect("a manifest");
        let (_, rest) = text.split_once("[dependencies]").expect("dependencies");
        let table = rest.split("\n[").next().expect("a table");
        let used = table
            .lines()
            .filter_map(|line| line.split(['.', ' ', '=']).next());
        let used: Vec<_> = used.filter(|u| ours.contains(u)).collect();
        assert!(used.iter().all(|u| below.contains(u)), "{name}: {used:?}");
    }
}

#[test]
fn an_arrow_up_and_a_circle_are_seen() {
    let module = |name: &str| name.split("::").map(str::to_owned).collect::<Vec<_>>();
    let sources: Sources = [
        (
            "fit::scan",
            "use crate::{\n    result::tails,\n    report::findings::sentence,\n};\n",
        ),
        ("report::findings", "fn a() { crate::fit::scan::b(); }\n"),
        ("result::tails", "// crate::pipeline::x\n"),
        ("search", "use super::result::tails; fn b() { tails::c() }"),
    ]
    .into_iter()
    .map(|(name, text)| (module(name), code(text)))
    .collect();
    let arrows = arrows(&sources);
    assert_eq!(upward(&arrows), ["fit::scan -> report::findings"]);
    assert_eq!(circular(&arrows), ["fit::scan", "report::findings"]);
    assert!(arrows.contains(&(module("search"), module("result::tails"))));
}
