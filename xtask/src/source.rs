//! The little of Rust's grammar that tells which file uses which: paths, `use` trees, items, without what is for tests.

/// A path as written, with what it is called where it is imported.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Import {
    /// `*` where everything is imported.
    pub(crate) alias: String,
    pub(crate) path: Vec<String>,
    pub(crate) is_public: bool,
}

/// What a file says of others.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Source {
    /// Modules in files of their own that are compiled for tests alone.
    pub(crate) test_modules: Vec<String>,
    pub(crate) imports: Vec<Import>,
    /// Paths outside of imports.
    pub(crate) paths: Vec<Vec<String>>,
    /// Names of items.
    pub(crate) items: Vec<String>,
}

impl Source {
    pub(crate) fn parse(text: &str) -> Self {
        let tokens = tokens(text);
        let mut parser = Parser { tokens: &tokens, at: 0 };
        let mut source = Self::default();
        parser.file(&mut source);
        source
    }
}

struct Parser<'t> {
    tokens: &'t [String],
    at: usize,
}

impl Parser<'_> {
    fn peek(&self, ahead: usize) -> &str {
        self.tokens.get(self.at + ahead).map_or("", String::as_str)
    }

    fn file(&mut self, source: &mut Source) {
        // Depths of braces at which inline modules opened.
        let (mut depth, mut modules) = (0_usize, Vec::new());
        let mut is_public = false;
        while self.at < self.tokens.len() {
            match self.peek(0) {
                "#" => {
                    let is_test = self.attribute();
                    if is_test {
                        self.skip_item(source);
                    }
                }
                "pub" => {
                    is_public = true;
                    self.at += 1;
                    if self.peek(0) == "(" {
                        self.skip_group();
                    }
                    continue;
                }
                "use" => {
                    self.at += 1;
                    self.use_tree(&[], is_public, modules.len(), &mut source.imports);
                }
                "mod" if self.peek(2) == "{" => {
                    modules.push(depth);
                    self.at += 2;
                    continue;
                }
                "struct" | "enum" | "union" | "trait" | "type" | "fn" | "const" | "static" => {
                    source.items.push(self.peek(1).to_owned());
                    self.at += 1;
                }
                "macro_rules" => {
                    source.items.push(self.peek(2).to_owned());
                    self.at += 2;
                }
                "{" => {
                    depth += 1;
                    self.at += 1;
                }
                "}" => {
                    depth = depth.saturating_sub(1);
                    if modules.last() == Some(&depth) {
                        modules.pop();
                    }
                    self.at += 1;
                }
                word if is_name(word) && self.peek(1) == "::" => {
                    let path = self.path();
                    source.paths.extend(outside(path, modules.len()));
                }
                _ => self.at += 1,
            }
            is_public = false;
        }
    }

    /// Names joined by `::`.
    fn path(&mut self) -> Vec<String> {
        let mut path = vec![self.peek(0).to_owned()];
        self.at += 1;
        while self.peek(0) == "::" && is_name(self.peek(1)) {
            path.push(self.peek(1).to_owned());
            self.at += 2;
        }
        path
    }

    /// A tree after `use` or inside of its braces, up to the token that ends it.
    fn use_tree(&mut self, before: &[String], is_public: bool, inside: usize, imports: &mut Vec<Import>) {
        let mut path = before.to_vec();
        loop {
            match self.peek(0) {
                "::" => self.at += 1,
                "{" => {
                    self.at += 1;
                    while !matches!(self.peek(0), "}" | "") {
                        self.use_tree(&path, is_public, inside, imports);
                        if self.peek(0) == "," {
                            self.at += 1;
                        }
                    }
                    self.at += 1;
                    return;
                }
                "*" => {
                    self.at += 1;
                    let path = outside(path, inside);
                    imports.extend(path.map(|path| Import { alias: "*".to_owned(), path, is_public }));
                    return;
                }
                word if is_name(word) && word != "as" => {
                    path.push(word.to_owned());
                    self.at += 1;
                }
                _ => break,
            }
        }
        let mut alias = path.last().cloned().unwrap_or_default();
        if alias == "self" && path.len() > 1 {
            path.pop();
            alias = path.last().cloned().unwrap_or_default();
        }
        if self.peek(0) == "as" {
            alias = self.peek(1).to_owned();
            self.at += 2;
        }
        imports.extend(outside(path, inside).map(|path| Import { alias, path, is_public }));
        if self.peek(0) == ";" {
            self.at += 1;
        } else if !matches!(self.peek(0), "," | "}") {
            // No `use` after all; goes on behind it.
            self.at += 1;
        }
    }

    /// Passes an attribute and says whether it leaves the item to tests.
    fn attribute(&mut self) -> bool {
        self.at += 1;
        if self.peek(0) == "!" {
            self.at += 1;
        }
        let start = self.at;
        self.skip_group();
        let inside = &self.tokens[start..self.at.min(self.tokens.len())];
        let has = |word: &str| inside.iter().any(|token| token == word);
        inside.get(1).is_some_and(|token| token == "cfg") && has("test") && !has("not")
    }

    /// Passes the item at hand, noting a module in a file of its own.
    fn skip_item(&mut self, source: &mut Source) {
        while self.at < self.tokens.len() {
            match self.peek(0) {
                "mod" if self.peek(2) == ";" => source.test_modules.push(self.peek(1).to_owned()),
                ";" => break,
                "{" => return self.skip_group(),
                "(" | "[" => {
                    self.skip_group();
                    continue;
                }
                _ => {}
            }
            self.at += 1;
        }
        self.at += 1;
    }

    /// Passes a group in parentheses, brackets or braces.
    fn skip_group(&mut self) {
        let mut depth = 0;
        while self.at < self.tokens.len() {
            match self.peek(0) {
                "(" | "[" | "{" => depth += 1,
                ")" | "]" | "}" => depth -= 1,
                _ => {}
            }
            self.at += 1;
            if depth == 0 {
                return;
            }
        }
    }
}

/// A path as the file's own module would write it, if it leaves the inline modules it stands in.
fn outside(mut path: Vec<String>, inline_modules: usize) -> Option<Vec<String>> {
    for _ in 0..inline_modules {
        match path.first().map(String::as_str) {
            Some("super") => path.remove(0),
            Some("crate") => break,
            _ => return None,
        };
    }
    if path.first().is_some_and(|first| first == "self") {
        path.remove(0);
    }
    (!path.is_empty()).then_some(path)
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Names, `::` and single signs; comments, texts, characters and lifetimes are left out.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            comment(rest)
        } else if let Some(length) = literal(rest) {
            length
        } else if first.is_alphanumeric() || first == '_' {
            let length = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            tokens.push(rest[..length].to_owned());
            length
        } else if rest.starts_with("::") {
            tokens.push("::".to_owned());
            2
        } else {
            if !first.is_whitespace() {
                tokens.push(first.to_string());
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// The length of a block comment, which may hold others.
fn comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        if text[at..].starts_with("/*") {
            (depth, at) = (depth + 1, at + 2);
        } else if text[at..].starts_with("*/") {
            (depth, at) = (depth - 1, at + 2);
            if depth == 0 {
                return at;
            }
        } else {
            at += text[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    text.len()
}

/// The length of a text, a character or a lifetime that stands at the beginning.
fn literal(text: &str) -> Option<usize> {
    let prefix = ["br", "cr", "b", "c", "r", ""].into_iter().find(|prefix| {
        let Some(behind) = text.strip_prefix(prefix) else { return false };
        let rest = behind.trim_start_matches('#');
        (prefix.ends_with('r') || rest.len() == behind.len())
            && (rest.starts_with('"') || (*prefix == "b" || prefix.is_empty()) && rest.starts_with('\''))
    })?;
    let rest = &text[prefix.len()..];
    let hashes = rest.len() - rest.trim_start_matches('#').len();
    let start = prefix.len() + hashes + 1;
    if prefix.ends_with('r') {
        let end = format!("\"{}", "#".repeat(hashes));
        return Some(text[start..].find(&end).map_or(text.len(), |at| start + at + end.len()));
    }
    let quote = rest.chars().next()?;
    let mut characters = text[start..].char_indices();
    if quote == '\'' {
        let body = &text[start..];
        let mut two = body.chars();
        let is_character = body.starts_with('\\') || (two.next().is_some() && two.next() == Some('\''));
        if !is_character {
            return Some(start + body.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(body.len()));
        }
    }
    while let Some((at, character)) = characters.next() {
        match character {
            '\\' => drop(characters.next()),
            c if c == quote => return Some(start + at + 1),
            _ => {}
        }
    }
    Some(text.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_may_be_any() {
        for (text, length) in [("'’', x", 5), ("'a, b", 2), ("b'x'", 4), ("r#\"a\"#;", 6), ("\"é\" ", 4)] {
            assert_eq!(literal(text), Some(length), "{text}");
        }
        assert_eq!(literal("é"), None);
    }

    fn import(alias: &str, path: &str, is_public: bool) -> Import {
        let path = path.split("::").map(str::to_owned).collect();
        Import { alias: alias.to_owned(), path, is_public }
    }

    #[test]
    fn imports_are_read() {
        let source = Source::parse(
            "use crate::{a::{self, B as C}, d::*};\npub(crate) use super::e::F; // use crate::g;\nuse self::h::I;",
        );
        let expected = [
            import("a", "crate::a", false),
            import("C", "crate::a::B", false),
            import("*", "crate::d", false),
            import("F", "super::e::F", true),
            import("I", "h::I", false),
        ];
        assert_eq!(source.imports, expected);
    }

    #[test]
    fn paths_and_items_are_read_and_texts_are_not() {
        let source = Source::parse(
            r##"fn f<'a>(x: &'a crate::a::B) { g::h('"', b'\'', "crate::c::D", r#"" crate::e::F"#) }
            mod inline { struct S(super::i::J, super::super::k::L); }"##,
        );
        let path = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<_>>();
        let expected = ["crate::a::B", "g::h", "i::J", "super::k::L"].map(path);
        assert_eq!(source.paths, expected);
        assert_eq!(source.items, ["f", "S"]);
    }

    #[test]
    fn what_is_for_tests_is_left_out() {
        let source = Source::parse(
            "#[cfg(test)]\nmod tests { use crate::a::B; }\n#[cfg(test)] mod c;\nuse crate::d::E;\n\
             #[cfg(test)] use crate::f::G;\n#[cfg(not(test))] use crate::h::I;",
        );
        assert_eq!(source.imports, [import("E", "crate::d::E", false), import("I", "crate::h::I", false)]);
        assert_eq!(source.test_modules, ["c"]);
    }
}
