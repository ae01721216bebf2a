//! Contract (issue 14, step 2): the files of a crate have no circular imports, so that each can be read after
//! those that it uses. The test reads `use crate::…`, `use super::…` and such paths in the code, resolves
//! each to the file that it names, and searches for cycles. Names that the crate's root re-exports count as
//! no file; unit tests at the end of a file may import anything.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Text of each module of a crate, by module path (`push::engine`; empty for the root).
fn modules(src: &Path) -> BTreeMap<String, String> {
    fn visit(folder: &Path, prefix: &str, out: &mut BTreeMap<String, String>) {
        for entry in std::fs::read_dir(folder).expect("a folder of sources").flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if path.is_dir() {
                visit(&path, &format!("{prefix}{name}::"), out);
            } else if let Some(stem) = name.strip_suffix(".rs") {
                let module = match stem {
                    "lib" | "main" => String::new(),
                    "mod" => prefix.trim_end_matches("::").to_owned(),
                    stem => format!("{prefix}{stem}"),
                };
                let text = std::fs::read_to_string(&path).expect("a source file");
                let code = text.split("\n#[cfg(test)]").next().unwrap_or_default();
                let lines = code.lines().map(|l| l.split("//").next().unwrap_or_default());
                out.insert(module, lines.collect::<Vec<_>>().join("\n"));
            }
        }
    }
    let mut out = BTreeMap::new();
    visit(src, "", &mut out);
    out
}

/// Expands an import tree to single paths: `a::{b, c::{d}}` has two.
fn expand(tree: &str) -> Vec<String> {
    let Some((head, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        return vec![path.split_whitespace().collect()];
    };
    let inside = rest.rsplit_once('}').map_or(rest, |(inside, _)| inside);
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in inside.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match (c, depth) {
            (',', 0) => parts.push(String::new()),
            _ => parts.last_mut().expect("one part").push(c),
        }
    }
    let all = parts.iter().filter(|p| !p.trim().is_empty()).flat_map(|p| expand(p));
    all.map(|path| head.split_whitespace().collect::<String>() + &path).collect()
}

/// Finds the paths that begin with `crate`, `super` or `self` in the code of a module.
fn paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    for word in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(word) {
            let before = &code[..at];
            if before.ends_with(|c: char| is_name(c) || c == ':') {
                continue;
            }
            let rest = &code[at..];
            if before.ends_with("use ") {
                found.extend(expand(rest.split(';').next().unwrap_or_default()));
            } else {
                let end = rest.find(|c: char| !is_name(c) && c != ':').unwrap_or(rest.len());
                found.push(rest[..end].to_owned());
            }
        }
    }
    found
}

/// Resolves a path in module `from` to the module that it names: its longest part that is a module.
fn resolve(path: &str, from: &str, modules: &BTreeMap<String, String>) -> Option<String> {
    let mut at: Vec<&str> = from.split("::").filter(|s| !s.is_empty()).collect();
    for segment in path.split("::") {
        match segment {
            "crate" => at.clear(),
            "self" => {}
            "super" => {
                at.pop();
            }
            name => at.push(name),
        }
    }
    while !modules.contains_key(&at.join("::")) {
        at.pop()?;
    }
    Some(at.join("::")).filter(|module| !module.is_empty())
}

/// Finds a cycle of imports: the modules from one back to itself; `None` if there is no cycle.
fn circle(graph: &BTreeMap<String, BTreeSet<String>>) -> Option<Vec<String>> {
    fn walk(
        at: &str,
        graph: &BTreeMap<String, BTreeSet<String>>,
        way: &mut Vec<String>,
        done: &mut BTreeSet<String>,
    ) -> Option<Vec<String>> {
        if let Some(first) = way.iter().position(|m| m == at) {
            return Some(way[first..].to_vec());
        }
        if done.contains(at) {
            return None;
        }
        way.push(at.to_owned());
        let found = graph.get(at).into_iter().flatten().find_map(|next| walk(next, graph, way, done));
        way.pop();
        done.insert(at.to_owned());
        found
    }
    let mut done = BTreeSet::new();
    graph.keys().find_map(|start| walk(start, graph, &mut Vec::new(), &mut done))
}

fn graph(modules: &BTreeMap<String, String>) -> BTreeMap<String, BTreeSet<String>> {
    let arrows = |(module, code): (&String, &String)| {
        let to =
            paths(code).into_iter().filter_map(|p| resolve(&p, module, modules)).filter(|to| to != module);
        (module.clone(), to.collect())
    };
    modules.iter().map(arrows).collect()
}

#[test]
fn no_crate_imports_in_circles() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let mut circles = Vec::new();
    for entry in std::fs::read_dir(crates).expect("the crates").flatten() {
        let src = entry.path().join("src");
        if let Some(way) = circle(&graph(&modules(&src))) {
            circles.push(format!("{}: {}", entry.file_name().to_string_lossy(), way.join(" -> ")));
        }
    }
    assert!(circles.is_empty(), "files that import each other in circles:\n{}", circles.join("\n"));
}

#[test]
fn a_circle_is_seen_through_braces_and_inside_code() {
    let module = |name: &str, code: &str| (name.to_owned(), code.to_owned());
    let set = |b: &str| {
        [
            module("", "mod a; mod b; mod c;"),
            module("a", "use crate::{b::B, c};"),
            module("b", b),
            module("c", "fn f() {}"),
        ]
        .into()
    };
    assert_eq!(circle(&graph(&set("use crate::c::f; use crate::Face;"))), None);
    assert_eq!(circle(&graph(&set("fn g() { crate::a::h() }"))), Some(vec!["a".into(), "b".into()]));
}
