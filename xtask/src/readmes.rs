//! README.md of every published crate, made from the front page of its documentation: the first paragraph and the first
//! example, which is compiled there.

use std::fs;
use std::path::Path;

use crate::arrows::{self, Package};

/// What stands in place of a line for `Cargo.toml` where the crate is a program.
const PROGRAM: (&str, &str) = ("ndf-cli", "```sh\ncargo install ndf-cli\nndf demo\n```\n");

/// Writes the READMEs, or, for a check, fails where one is not what would be written.
pub(crate) fn run(check: bool) -> Result<(), String> {
    let mut stale = Vec::new();
    for Package { name, folder, .. } in arrows::published()? {
        let library = folder.join("src/lib.rs");
        let source = fs::read_to_string(&library).map_err(|e| format!("{}: {e}", library.display()))?;
        let file = folder.join("README.md");
        let readme = readme(&name, &source);
        if !check {
            fs::write(&file, readme).map_err(|e| format!("{}: {e}", file.display()))?;
        } else if !is_current(&file, &readme) {
            stale.push(name);
        }
    }
    if stale.is_empty() {
        Ok(())
    } else {
        Err(format!("the READMEs of {} are stale; `cargo xtask readmes` writes them", stale.join(", ")))
    }
}

fn is_current(file: &Path, readme: &str) -> bool {
    // Git may have made other line ends.
    fs::read_to_string(file).is_ok_and(|text| text.replace("\r\n", "\n") == readme)
}

fn readme(name: &str, source: &str) -> String {
    let page: Vec<&str> = source
        .lines()
        .take_while(|line| line.starts_with("//!"))
        .map(|line| line.trim_start_matches("//!"))
        .map(|line| line.strip_prefix(' ').unwrap_or(line))
        .collect();
    let paragraph: Vec<String> =
        page.iter().take_while(|line| !line.is_empty()).map(|l| without_links(l)).collect();
    let mut readme = format!("# {name}\n\n{}\n\n", paragraph.join("\n"));
    if name == PROGRAM.0 {
        readme += PROGRAM.1;
    } else {
        let mut example = page.iter().skip_while(|line| !line.starts_with("```"));
        example.next();
        let shown: Vec<&str> = example
            .take_while(|line| !line.starts_with("```"))
            .copied()
            .filter(|line| *line != "#" && !line.starts_with("# "))
            .collect();
        readme += &format!("```toml\n[dependencies]\n{}```\n", dependencies(name, &shown));
        if !shown.is_empty() {
            readme += &format!("\n```rust\n{}\n```\n", shown.join("\n"));
        }
    }
    readme +=
        "\nA part of [ndf](https://example.org/ndf), geometry processing with neural displacement fields. ";
    readme + "Licensed under MIT or Apache-2.0, at your option.\n"
}

/// The lines for the crate and for others of the workspace that its example names.
fn dependencies(name: &str, example: &[&str]) -> String {
    let mut crates = vec![name.to_owned()];
    for line in example {
        let words = line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        for word in words.filter(|word| word.starts_with("ndf_")) {
            let name = word.replace('_', "-");
            if !crates.contains(&name) {
                crates.push(name);
            }
        }
    }
    crates.iter().map(|name| format!("{name} = \"0.1\"\n")).collect()
}

/// A line without links to items, which lead nowhere outside the documentation.
fn without_links(line: &str) -> String {
    let mut text = String::new();
    let mut rest = line;
    while let Some((before, link)) = rest.split_once('[') {
        text += before;
        let Some((name, after)) = link.split_once(']') else {
            text.push('[');
            rest = link;
            continue;
        };
        text += name;
        let target = after.strip_prefix('(').and_then(|after| after.split_once(')'));
        rest = target.map_or(after, |(_, after)| after);
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_page_becomes_a_readme() {
        let source = "//! Makes [`Tea`](tea::Tea) and [more]\n//! of it.\n//!\n//! Not this.\n//!\n//! ```\n//! # use a::b;\n\
                      //! ndf_pot::make();\n//! # Ok::<(), E>(())\n//! ```\n\nmod tea;\n";
        let readme = readme("tea", source);
        let expected = "# tea\n\nMakes `Tea` and more\nof it.\n\n```toml\n[dependencies]\ntea = \"0.1\"\nndf-pot = \"0.1\"\n```\n\n\
                        ```rust\nndf_pot::make();\n```\n\n";
        assert!(readme.starts_with(expected), "{readme}");
    }
}
