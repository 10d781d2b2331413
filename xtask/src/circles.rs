//! Circles between the modules of a crate.
//!
//! Of the children of a module, which may have children themselves, each may use others as long as none leads back to it. A
//! module and its own children are one thing and free in how they use each other. A file uses another where it names one of
//! its items by a path, followed through imports and re-exports to the file that defines the item; a re-export by itself is
//! no use. Tests are free.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::shell::root;
use crate::source::{Import, Source};

/// Crates whose circles are an error; those of others are only printed.
const STRICT: &[&str] = &[
    "ndf",
    "ndf-cli",
    "ndf-core",
    "ndf-formats",
    "ndf-geodesic",
    "ndf-intrinsic",
    "ndf-mesh",
    "ndf-meshing",
    "ndf-model",
    "ndf-network",
    "ndf-surfaces",
    "ndf-testing",
    "ndf-viewer",
    "ndf-web",
];

/// Prints the circles of all crates, given by names and folders.
pub(crate) fn check<'a>(crates: impl IntoIterator<Item = (&'a str, &'a Path)>) -> Result<(), String> {
    let mut forbidden = 0;
    for (name, folder) in crates {
        let modules = Modules::read(&folder.join("src"))?;
        for circle in modules.circles() {
            eprintln!("{name}: a circle of {} modules", circle.modules.len());
            for (from, to, names) in &circle.uses {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                eprintln!("  {} uses {}: {}", modules.file(from), modules.file(to), names.join(", "));
            }
            forbidden += usize::from(STRICT.contains(&name));
        }
    }
    if forbidden == 0 { Ok(()) } else { Err(format!("{forbidden} circles between modules")) }
}

/// The names of a module from the root of its crate.
type Names = Vec<String>;

struct Module {
    file: PathBuf,
    source: Source,
}

/// A module that uses another, and the names it uses.
type Use<'m> = (&'m Names, &'m Names, BTreeSet<String>);

/// Children of one module of which each leads to all others.
#[derive(Debug)]
struct Circle<'m> {
    modules: BTreeSet<&'m Names>,
    uses: Vec<Use<'m>>,
}

/// The modules of a crate that have files of their own.
struct Modules(BTreeMap<Names, Module>);

impl Modules {
    fn read(folder: &Path) -> Result<Self, String> {
        let mut modules = BTreeMap::new();
        if folder.is_dir() {
            read_folder(folder, folder, &mut modules).map_err(|e| format!("{}: {e}", folder.display()))?;
        }
        let tests: Vec<Names> = modules
            .iter()
            .flat_map(|(names, module)| {
                let child = |name: &String| names.iter().chain([name]).cloned().collect();
                module.source.test_modules.iter().map(child).collect::<Vec<Names>>()
            })
            .collect();
        modules.retain(|names, _| !tests.iter().any(|test| names.starts_with(test)));
        Ok(Self(modules))
    }

    fn file(&self, names: &Names) -> String {
        let file = &self.0[names].file;
        file.strip_prefix(root()).unwrap_or(file).display().to_string()
    }

    /// The modules that each uses, with the names it uses there.
    fn uses(&self, from: &Names) -> BTreeMap<&Names, BTreeSet<String>> {
        let source = &self.0[from].source;
        let mut uses: BTreeMap<&Names, BTreeSet<String>> = BTreeMap::new();
        let imported = source.imports.iter().filter(|import| !import.is_public);
        let imported = imported.map(|Import { alias, path, .. }| (path, alias == "*"));
        for (path, is_glob) in imported.chain(source.paths.iter().map(|path| (path, false))) {
            let Some((to, item)) = self.resolve(from, path, 0) else { continue };
            // A module that is imported by name is used where its items are.
            let is_module = item.is_empty() && !is_glob;
            if to != from && !is_module {
                uses.entry(to).or_default().insert(if is_glob { "*".to_owned() } else { item });
            }
        }
        uses
    }

    /// The module that defines what a path of a module leads to, and the name it has there, empty for the module itself.
    fn resolve(&self, from: &Names, path: &[String], depth: usize) -> Option<(&Names, String)> {
        let mut at = from.clone();
        let mut rest = path;
        if rest.first()? == "crate" {
            at.clear();
            rest = &rest[1..];
        }
        while rest.first().is_some_and(|first| first == "super") {
            at.pop()?;
            rest = &rest[1..];
        }
        let is_relative = rest.len() == path.len();
        for (i, name) in rest.iter().enumerate() {
            let child: Names = at.iter().chain([name]).cloned().collect();
            if self.0.contains_key(&child) {
                at = child;
                continue;
            }
            let (here, module) = self.0.get_key_value(&at)?;
            if let Some(found) = self.imported(here, module, name, depth) {
                // An import of a module leads on into it.
                match found {
                    (module, item) if item.is_empty() => at.clone_from(module),
                    found => return Some(found),
                }
                continue;
            }
            // A path that begins with no name of this module is of another crate or of a type.
            let is_known = !is_relative || i > 0;
            return is_known.then(|| (here, name.clone()));
        }
        self.0.get_key_value(&at).map(|(names, _)| (names, String::new()))
    }

    /// What a module imports by a name.
    fn imported<'m>(
        &'m self,
        here: &'m Names,
        module: &'m Module,
        name: &str,
        depth: usize,
    ) -> Option<(&'m Names, String)> {
        if depth > 8 || module.source.items.iter().any(|item| item == name) {
            return None;
        }
        let mut imports = module.source.imports.iter();
        if let Some(import) = imports.find(|import| import.alias == name) {
            return self.resolve(here, &import.path, depth + 1);
        }
        let globs = module.source.imports.iter().filter(|import| import.alias == "*" && import.is_public);
        globs.filter_map(|glob| self.resolve(here, &glob.path, depth + 1)).find_map(|(to, item)| {
            let target = &self.0[to];
            if !item.is_empty() {
                None
            } else if target.source.items.iter().any(|item| item == name) {
                Some((to, name.to_owned()))
            } else {
                self.imported(to, target, name, depth + 1)
            }
        })
    }

    fn circles(&self) -> Vec<Circle<'_>> {
        let uses = |from| self.uses(from).into_iter().map(move |(to, names)| (from, to, names));
        let uses: Vec<Use<'_>> = self.0.keys().flat_map(uses).collect();
        self.0.keys().flat_map(|parent| self.circles_below(parent, &uses)).collect()
    }

    /// Circles of the children of a module.
    fn circles_below<'m>(&'m self, parent: &Names, uses: &[Use<'m>]) -> Vec<Circle<'m>> {
        let depth = parent.len() + 1;
        let child = |names: &Names| {
            let names = names.starts_with(parent).then(|| names.get(..depth))??;
            self.0.get_key_value(names).map(|(child, _)| child)
        };
        let mut graph: BTreeMap<&Names, BTreeSet<&Names>> = BTreeMap::new();
        for (from, to, _) in uses {
            if let Some((from, to)) = child(from).zip(child(to)).filter(|(from, to)| from != to) {
                graph.entry(from).or_default().insert(to);
            }
        }
        let reached: BTreeMap<&Names, BTreeSet<&Names>> =
            graph.keys().map(|from| (*from, reached(&graph, from))).collect();
        let mut circles: Vec<Circle<'m>> = Vec::new();
        for (from, to) in &reached {
            let leads_back = |to: &&Names| reached.get(to).is_some_and(|back| back.contains(from));
            let modules: BTreeSet<&Names> = to.iter().copied().filter(leads_back).collect();
            if modules.len() > 1 && circles.iter().all(|circle| circle.modules != modules) {
                let is_within = |(from, to, _): &&Use<'m>| {
                    let ends = child(from).zip(child(to));
                    ends.is_some_and(|(a, b)| a != b && modules.contains(a) && modules.contains(b))
                };
                let uses = uses.iter().filter(is_within).cloned().collect();
                circles.push(Circle { modules, uses });
            }
        }
        circles
    }
}

/// All that a node of a graph leads to.
fn reached<'m>(graph: &BTreeMap<&'m Names, BTreeSet<&'m Names>>, from: &Names) -> BTreeSet<&'m Names> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(next) = open.pop() {
        for &to in graph.get(next).into_iter().flatten() {
            if reached.insert(to) {
                open.push(to);
            }
        }
    }
    reached
}

fn read_folder(root: &Path, folder: &Path, modules: &mut BTreeMap<Names, Module>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let file = entry?.path();
        if file.is_dir() {
            read_folder(root, &file, modules)?;
            continue;
        }
        if file.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        let below = file.strip_prefix(root).unwrap_or(&file).with_extension("");
        let mut names: Names = below.iter().map(|name| name.to_string_lossy().into_owned()).collect();
        match names.last().map(String::as_str) {
            // The program beside a library uses it as another crate.
            Some("main") if names.len() == 1 && root.join("lib.rs").exists() => continue,
            Some("lib" | "main") if names.len() == 1 => names.clear(),
            Some("mod") => drop(names.pop()),
            _ => {}
        }
        let source = Source::parse(&fs::read_to_string(&file)?);
        modules.insert(names, Module { file, source });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn modules(files: &[(&str, &str)]) -> Modules {
        let module = |&(names, text): &(&str, &str)| {
            let names = names.split('/').filter(|name| !name.is_empty()).map(str::to_owned).collect();
            (names, Module { file: PathBuf::new(), source: Source::parse(text) })
        };
        Modules(files.iter().map(module).collect())
    }

    fn circles(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let modules = modules(files);
        let circles = modules.circles().into_iter().map(|circle| circle.modules);
        circles.map(|circle| circle.into_iter().map(|names| names.join("/")).collect()).collect()
    }

    #[test]
    fn a_circle_is_found_through_re_exports() {
        let files = [
            ("", "mod a; mod b; pub use a::A; pub use b::*;"),
            ("a", "use crate::B; pub struct A(B);"),
            ("b", "pub struct B; fn f() { crate::A::new(); }"),
        ];
        assert_eq!(circles(&files), [["a", "b"]]);
    }

    #[test]
    fn a_circle_is_found_through_children() {
        let files = [
            ("", "mod a; mod b;"),
            ("a", "mod c; pub struct A;"),
            ("a/c", "use crate::b::B;"),
            ("b", "use crate::a::A; pub struct B(A);"),
        ];
        assert_eq!(circles(&files), [["a", "b"]]);
    }

    #[test]
    fn parents_and_children_are_no_circle() {
        let files = [
            ("", "mod a; pub use a::A; pub struct Root;"),
            ("a", "mod b; mod c; use b::B; use crate::Root; pub struct A(Root, B);"),
            ("a/b", "use super::A; use super::c::C; pub struct B(A);"),
            ("a/c", "use super::A; pub struct C(A);"),
        ];
        assert!(circles(&files).is_empty());
    }
}
