//! Rust files as text, and what of it is code: comments, literals and tests become spaces, so that
//! lines and columns stay where they are. Not a parser: it knows just enough for the rules here.

/// What marks an item that exists for tests, or for tests and fuzzers, only.
const FOR_TESTS: [&str; 2] = ["#[cfg(test)]", "#[cfg(any(test, fuzzing))]"];

/// One Rust file.
#[derive(Clone, Debug)]
pub(crate) struct RustFile {
    /// From the repository's root.
    pub(crate) path: String,
    /// All of it.
    pub(crate) source: String,
    /// Whether the whole file is a test or serves one.
    pub(crate) is_test: bool,
}

impl RustFile {
    /// The file with `source` at `path`, by which alone it is taken for a test or not.
    pub(crate) fn new(path: &str, source: &str) -> Self {
        let is_test = path.ends_with("/tests.rs") || path.split('/').any(|part| part == "tests");
        Self { path: path.to_owned(), source: source.to_owned(), is_test }
    }

    /// The module that the file holds: `agent/src/oracle/replay.rs` is `agent::oracle::replay`.
    /// `None` for what is no part of a crate's library or program.
    pub(crate) fn module(&self) -> Option<String> {
        let (package, inside) = self.path.strip_suffix(".rs")?.split_once("/src/")?;
        let mut segments = vec![package.replace('-', "_")];
        segments.extend(inside.split('/').map(str::to_owned));
        if matches!(segments.last()?.as_str(), "mod" | "lib" | "main") {
            segments.pop();
        }
        Some(segments.join("::"))
    }

    /// What the product is built from: the code that is no test; nothing of a test file.
    pub(crate) fn product_code(&self) -> String {
        if self.is_test { String::new() } else { without_tests(&code_of(&self.source)) }
    }
}

/// Marks files that their parent declares for tests only: `#[cfg(test)] mod name;`.
pub(crate) fn mark_modules_for_tests(files: &mut [RustFile]) {
    let for_tests: Vec<String> = files.iter().flat_map(modules_for_tests).collect();
    for file in files {
        let module = file.module().unwrap_or_default();
        file.is_test |= for_tests.iter().any(|outer| is_inside(&module, outer));
    }
}

/// Whether the path `module` is `outer` or leads into it.
pub(crate) fn is_inside(module: &str, outer: &str) -> bool {
    module.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
}

fn modules_for_tests(file: &RustFile) -> Vec<String> {
    let Some(module) = file.module() else { return Vec::new() };
    let code = code_of(&file.source);
    let marked = FOR_TESTS.iter().flat_map(|attribute| code.split(attribute).skip(1));
    let declared = marked.filter_map(|after| {
        let (item, _) = after.split_once([';', '{'])?;
        let (_, name) = item.split_once("mod ")?;
        Some(format!("{module}::{}", name.trim()))
    });
    declared.collect()
}

/// `source` without comments and without the contents of literals.
pub(crate) fn code_of(source: &str) -> String {
    let bytes = source.as_bytes();
    let mut code = Vec::with_capacity(bytes.len());
    while code.len() < bytes.len() {
        let at = code.len();
        match length_of_other(bytes, at) {
            0 => code.push(bytes[at]),
            length => code.extend(bytes[at..at + length].iter().map(|&byte| blank(byte))),
        }
    }
    String::from_utf8(code).unwrap()
}

/// `code` (of [`code_of`]) without items that exist for tests only.
pub(crate) fn without_tests(code: &str) -> String {
    let mut bytes = code.as_bytes().to_owned();
    for attribute in FOR_TESTS.iter().chain(&["#[test]"]) {
        for (start, _) in code.match_indices(attribute) {
            let end = end_of_item(code, start + attribute.len());
            bytes[start..end].iter_mut().for_each(|byte| *byte = blank(*byte));
        }
    }
    String::from_utf8(bytes).unwrap()
}

/// The line, from 1, of byte `at`.
pub(crate) fn line_of(text: &str, at: usize) -> usize {
    text[..at].matches('\n').count() + 1
}

fn blank(byte: u8) -> u8 {
    if byte == b'\n' { byte } else { b' ' }
}

/// Bytes of the comment or literal that begins at `at`, 0 if code does.
fn length_of_other(bytes: &[u8], at: usize) -> usize {
    let rest = &bytes[at..];
    if rest.starts_with(b"//") {
        return rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
    }
    if rest.starts_with(b"/*") {
        return length_of_block_comment(rest);
    }
    match rest[0] {
        b'"' => length_of_quoted(rest),
        b'\'' => length_of_character(rest),
        b'r' if at == 0 || !is_word(bytes[at - 1]) || is_byte_prefix(bytes, at) => {
            length_of_raw_string(rest)
        }
        _ => 0,
    }
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Whether the `r` at `at` follows the `b` or `c` of a raw byte or C string.
fn is_byte_prefix(bytes: &[u8], at: usize) -> bool {
    matches!(bytes[at - 1], b'b' | b'c') && (at == 1 || !is_word(bytes[at - 2]))
}

fn length_of_block_comment(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0_usize, 0);
    while at < rest.len() {
        if rest[at..].starts_with(b"/*") {
            (depth, at) = (depth + 1, at + 2);
        } else if rest[at..].starts_with(b"*/") {
            (depth, at) = (depth - 1, at + 2);
            if depth == 0 {
                break;
            }
        } else {
            at += 1;
        }
    }
    at.min(rest.len())
}

/// Bytes of a string or character that ends with the quote it begins with.
fn length_of_quoted(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != rest[0] {
        at += if rest[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(rest.len())
}

/// Bytes of a character literal, 0 for a lifetime.
fn length_of_character(rest: &[u8]) -> usize {
    let is_escape = rest.get(1) == Some(&b'\\');
    let character_bytes = match rest.get(1) {
        Some(first) if *first >= 0xF0 => 4,
        Some(first) if *first >= 0xE0 => 3,
        Some(first) if *first >= 0xC0 => 2,
        _ => 1,
    };
    if is_escape || rest.get(1 + character_bytes) == Some(&b'\'') {
        length_of_quoted(rest)
    } else {
        0
    }
}

/// Bytes of a raw string that begins with its `r`, 0 if none does.
fn length_of_raw_string(rest: &[u8]) -> usize {
    let hashes = rest[1..].iter().take_while(|&&byte| byte == b'#').count();
    if rest.get(1 + hashes) != Some(&b'"') {
        return 0;
    }
    let end = [b"\"".as_slice(), &b"#".repeat(hashes)].concat();
    let body = &rest[hashes + 2..];
    let closing = body.windows(end.len()).position(|window| window == end);
    closing.map_or(rest.len(), |closing| hashes + 2 + closing + end.len())
}

/// Where the item ends whose attributes end at `start`: behind its block or its semicolon.
fn end_of_item(code: &str, start: usize) -> usize {
    let mut depth = 0_usize;
    for (offset, byte) in code[start..].bytes().enumerate() {
        match byte {
            b'{' => depth += 1,
            b'}' if depth == 1 => return start + offset + 1,
            b'}' => depth = depth.saturating_sub(1),
            b';' if depth == 0 => return start + offset + 1,
            _ => {}
        }
    }
    code.len()
}

#[test]
fn comments_and_literals_are_no_code() {
    let check = |source: &str, expected: &str| {
        let code = code_of(source);
        assert_eq!(code.len(), source.len(), "{source}");
        assert_eq!(code.split_whitespace().collect::<Vec<_>>().join(" "), expected, "{source}");
    };
    check("a // b\nc", "a c");
    check("/// b.unwrap()\nc", "c");
    check("a /* b /* c */ d */ e", "a e");
    check(r#"a "b \" c" d"#, "a d");
    check(r##"a r"b\" c r#"d " e"# f"##, "a c f");
    check(r##"a br#"d " e"# f"##, "a b f");
    check("a 'b' c '\\'' d '\u{e4}' e", "a c d e");
    check("fn a<'b>(c: &'b str) {}", "fn a<'b>(c: &'b str) {}");
    check("for r in x", "for r in x");
}

#[test]
fn a_file_is_the_module_that_its_path_says() {
    let check = |path: &str, expected: Option<&str>| {
        assert_eq!(RustFile::new(path, "").module().as_deref(), expected, "{path}");
    };
    check("shared-types/src/lib.rs", Some("shared_types"));
    check("agent/src/oracle/mod.rs", Some("agent::oracle"));
    check("agent/src/oracle/replay.rs", Some("agent::oracle::replay"));
    check("agent/tests/laws.rs", None);
}

#[test]
fn a_file_that_is_declared_for_tests_is_one() {
    let mut files = [
        RustFile::new("a/src/b/mod.rs", "#[cfg(test)]\npub(crate) mod sample;\nmod store;"),
        RustFile::new("a/src/b/sample.rs", "fn c() { d.unwrap() }"),
        RustFile::new("a/src/b/store.rs", "fn c() {}"),
        RustFile::new("a/src/lib.rs", "#[cfg(any(test, fuzzing))]\npub mod fuzzing;"),
        RustFile::new("a/src/fuzzing/mod.rs", "fn c() { d.unwrap() }"),
    ];
    mark_modules_for_tests(&mut files);
    assert_eq!(files.each_ref().map(|file| file.is_test), [false, true, false, false, true]);
    assert_eq!(files[1].product_code(), "");
}

#[test]
fn items_for_tests_are_left_out() {
    let source = "fn a() {}\n#[cfg(test)]\nmod tests {\n fn b() { { } }\n}\nfn c() {}";
    let code = without_tests(&code_of(source));
    assert_eq!(code.split_whitespace().collect::<String>(), "fna(){}fnc(){}");
    assert_eq!(line_of(&code, code.find("fn c").unwrap()), 6);
    let declared = without_tests("#[cfg(test)]\nmod tests;\nfn a() {}");
    assert_eq!(declared.trim(), "fn a() {}");
}
