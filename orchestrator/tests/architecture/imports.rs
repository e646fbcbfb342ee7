//! Which paths a Rust file names, resolved to where they lead.
//!
//! Every path of at least two segments counts, in a `use` or in an expression; groups are taken apart.
//! A path that begins with a module in scope stays as it stands, for that module came into scope by a
//! path that is seen. Re-exports are not followed.

use crate::rust_text::{RustFile, is_inside, line_of};

/// A path with the line it stands on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Import {
    /// From 1.
    pub(crate) line: usize,
    /// Segments, joined by `::`; `crate`, `self` and `super` are resolved.
    pub(crate) path: String,
}

impl Import {
    /// Whether it leads to `module` or into it.
    pub(crate) fn leads_into(&self, module: &str) -> bool {
        is_inside(&self.path, module)
    }
}

/// Every path in the product code of `file`; none if it is no part of a crate's library or program.
pub(crate) fn imports_of(file: &RustFile) -> Vec<Import> {
    let Some(module) = file.module() else { return Vec::new() };
    let code = file.product_code();
    let mut scanner = Scanner { tokens: tokens_of(&code), next: 0, found: Vec::new() };
    while scanner.next < scanner.tokens.len() {
        match scanner.tokens[scanner.next].text {
            // A path that follows `::` is the rest of one that was taken, or of a generic type.
            "::" => scanner.next += 2,
            text if is_name(text) => scanner.take_path(&[]),
            _ => scanner.next += 1,
        }
    }
    let resolved = scanner.found.into_iter().map(|(at, segments)| Import {
        line: line_of(&code, at),
        path: resolve(&segments, &module),
    });
    resolved.collect()
}

#[derive(Clone, Copy)]
struct Token<'a> {
    at: usize,
    text: &'a str,
}

fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_alphabetic() || first == '_')
}

/// Names and numbers, `::`, and every other character that is not white space by itself.
fn tokens_of(code: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = code[at..].chars().next() {
        let rest = &code[at..];
        let is_word = |character: char| character.is_alphanumeric() || character == '_';
        let length = if is_word(first) {
            rest.find(|character| !is_word(character)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        if !first.is_whitespace() {
            tokens.push(Token { at, text: &rest[..length] });
        }
        at += length;
    }
    tokens
}

struct Scanner<'a> {
    tokens: Vec<Token<'a>>,
    next: usize,
    found: Vec<(usize, Vec<&'a str>)>,
}

impl<'a> Scanner<'a> {
    fn text(&self, ahead: usize) -> &'a str {
        self.tokens.get(self.next + ahead).map_or("", |token| token.text)
    }

    /// Takes the path, or the group of paths, that begins at the next token, behind `prefix`.
    fn take_path(&mut self, prefix: &[&'a str]) {
        let at = self.tokens[self.next].at;
        let mut segments = prefix.to_vec();
        loop {
            segments.push(self.text(0));
            self.next += 1;
            if self.text(0) != "::" {
                break;
            }
            self.next += 1;
            if self.text(0) == "{" {
                return self.take_group(&segments);
            }
            if !is_name(self.text(0)) {
                // A glob, or the arguments of a generic function.
                self.next += usize::from(self.text(0) == "*");
                break;
            }
        }
        if segments.len() > 1 {
            self.found.push((at, segments));
        }
    }

    /// Takes the paths between the brace at the next token and the one that closes it.
    fn take_group(&mut self, prefix: &[&'a str]) {
        self.next += 1;
        while self.next < self.tokens.len() {
            match self.text(0) {
                "}" => {
                    self.next += 1;
                    return;
                }
                "as" => self.next += 2,
                text if is_name(text) => self.take_path(prefix),
                "*" => {
                    self.found.push((self.tokens[self.next].at, prefix.to_vec()));
                    self.next += 1;
                }
                _ => self.next += 1,
            }
        }
    }
}

fn resolve(segments: &[&str], module: &str) -> String {
    let mut place: Vec<&str> = module.split("::").collect();
    let mut rest = segments;
    match rest[0] {
        "crate" => {
            place.truncate(1);
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {
            while let Some(("super", after)) =
                rest.split_first().map(|(first, after)| (*first, after))
            {
                place.pop();
                rest = after;
            }
        }
        _ => place.clear(),
    }
    place.extend(rest.iter().filter(|segment| **segment != "self"));
    place.join("::")
}

#[test]
fn paths_are_found_wherever_they_stand() {
    let check = |code: &str, expected: &[&str]| {
        let file = RustFile::new("agent/src/oracle/replay.rs", code);
        let found: Vec<String> = imports_of(&file).into_iter().map(|found| found.path).collect();
        assert_eq!(found, expected, "{code}");
    };
    check("use crate::blackboard::Facts;", &["agent::blackboard::Facts"]);
    check("use super::count;", &["agent::oracle::count"]);
    check("use super::super::craft::{self, Craft};", &["agent::craft", "agent::craft::Craft"]);
    check(
        "use shared_types::{ids::{A, B as C}, wire::*};",
        &["shared_types::ids::A", "shared_types::ids::B", "shared_types::wire"],
    );
    check("fn a() -> b::C<d::E> { crate::f::<g::H>() }", &["b::C", "d::E", "agent::f", "g::H"]);
    check("let a = self::b::c(d); e.f(g)", &["agent::oracle::replay::b::c"]);
    check("use alone;", &[]);
}
