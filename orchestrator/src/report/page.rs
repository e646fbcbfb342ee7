//! One page that holds a run's report: tables, pictures and the text of the terminal, in a single file
//! without scripts and without anything that would have to be fetched.
//!
//! Also writes that page and the pictures. What is in them is decided elsewhere; the same run gives the
//! same bytes.

use super::capacities;
use super::loads;
use super::svg::element::Element;
use super::svg::look::style_sheet;
use super::svg::picture::Picture;
use super::table::Table;
use crate::results::provenance::Provenance;
use crate::results::read::Missing;
use crate::results::summary::Summary;
use std::path::{Path, PathBuf};

/// Name of the page.
pub const PAGE_FILE: &str = "report.html";
/// Name of the folder of pictures.
pub const PICTURES_FOLDER: &str = "pictures";

/// Heading of the first table of loads.
const LOADS_HEADING: &str = "Under load: what is known how soon, and at what cost";

/// Heading of the table of the highest loads that were borne.
const CAPACITY_HEADING: &str = "Capacity";

/// Everything that a page shows.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// The scenario's name.
    pub title: String,
    /// Where the results come from, a line each.
    pub origin: Vec<String>,
    /// What could not be read.
    pub missing: Vec<Missing>,
    /// Heading and table.
    pub tables: Vec<(String, Table)>,
    /// In their order.
    pub pictures: Vec<Picture>,
    /// The whole report as on a terminal.
    pub text: String,
}

/// Style of everything but the pictures.
const STYLE: &str = "\
:root{color-scheme:light dark}\
body{font-family:Helvetica,Arial,Liberation Sans,sans-serif;max-width:62rem;margin:1.5rem auto;\
padding:0 1rem;line-height:1.4;background:#fff;color:#1b1f24}\
h1{font-size:1.5rem}h2{font-size:1.2rem;margin-top:2.2rem}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
table{font-size:.9rem}th,td{padding:.15rem .5rem;text-align:right;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}\
thead tr:last-child th{border-bottom:1px solid #57606a}tbody th{padding-top:.7rem}\
.wide{overflow-x:auto}pre{overflow-x:auto;font-size:.8rem}\
figure{margin:1.5rem 0;border:1px solid #d8dee4}figure svg{display:block;width:100%;height:auto}\
.missing{border-left:4px solid #d55e00;padding-left:.8rem}\
@media screen and (prefers-color-scheme:dark){body{background:#14171b;color:#e8eaed}\
figure{border-color:#343a42}thead th{border-color:#a5adb8}}\
@media print{figure,table{break-inside:avoid}}\n";

impl Page {
    /// The page of the run that `summary` is of: its tables, then those of what it bore under load.
    #[must_use]
    pub fn of(
        summary: &Summary,
        tables: Vec<(String, Table)>,
        pictures: Vec<Picture>,
        text: String,
    ) -> Self {
        let mut tables = tables;
        if !summary.timing.loads.is_empty() {
            tables.push((LOADS_HEADING.to_owned(), loads::main_table(summary)));
            let details = loads::details(summary).into_iter();
            let filled = details.filter(|(_, table)| !table.is_empty());
            tables.extend(filled.map(|(heading, table)| (heading.to_owned(), table)));
        }
        let borne = capacities::table(summary);
        if !borne.is_empty() {
            tables.push((CAPACITY_HEADING.to_owned(), borne));
        }
        let name = summary.deterministic.scenario.clone();
        let origin = summary.timing.provenance.as_ref().map_or_else(Vec::new, origin);
        Self {
            title: name.unwrap_or_else(|| "A run of unknown scenario".to_owned()),
            origin,
            missing: summary.timing.missing.clone(),
            tables,
            pictures,
            text,
        }
    }

    /// The page as HTML.
    #[must_use]
    pub fn html(&self) -> String {
        let mut body = Element::new("main").holding(Element::new("h1").text(&self.title));
        let mut origin = Element::new("p");
        for (place, line) in self.origin.iter().enumerate() {
            let line = if place == 0 { line.clone() } else { format!("; {line}") };
            origin = origin.text(line);
        }
        body.push(origin);
        if !self.missing.is_empty() {
            body.push(self.missing_part());
        }
        for (heading, table) in &self.tables {
            body.push(Element::new("h2").text(heading));
            body.push(Element::new("div").with("class", "wide").holding(table.html()));
        }
        if !self.pictures.is_empty() {
            body.push(Element::new("h2").text("Pictures"));
        }
        for picture in &self.pictures {
            body.push(Element::new("figure").with("id", &picture.name).holding(picture.inline()));
        }
        body.push(Element::new("h2").text("As on the terminal"));
        body.push(Element::new("pre").text(&self.text));
        let title = Element::new("title").text(format!("{} - Slateswarm", self.title)).render();
        let style = Element::new("style").text(format!("{STYLE}{}", style_sheet())).render();
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             {title}\n{style}\n</head>\n<body>\n{}\n</body>\n</html>\n",
            body.render()
        )
    }

    fn missing_part(&self) -> Element {
        let mut list = Element::new("ul");
        for Missing { file, what } in &self.missing {
            list.push(Element::new("li").text(format!("{file}: {what}")));
        }
        Element::new("div")
            .with("class", "missing")
            .holding(Element::new("p").text("Not everything could be read:"))
            .holding(list)
    }

    /// Writes the page and each picture below `directory`, and names what was written. A file that is
    /// there is replaced.
    ///
    /// # Errors
    /// If something cannot be written; what was written before stays.
    pub fn write(&self, directory: &Path) -> Result<Vec<PathBuf>, PageError> {
        let folder = directory.join(PICTURES_FOLDER);
        std::fs::create_dir_all(&folder)
            .map_err(|source| PageError { path: folder.clone(), source })?;
        let page = (directory.join(PAGE_FILE), self.html());
        let pictures = self
            .pictures
            .iter()
            .map(|picture| (folder.join(format!("{}.svg", picture.name)), picture.document()));
        let mut written = Vec::new();
        for (path, text) in std::iter::once(page).chain(pictures) {
            replace(&path, &text).map_err(|source| PageError { path: path.clone(), source })?;
            written.push(path);
        }
        Ok(written)
    }
}

fn origin(provenance: &Provenance) -> Vec<String> {
    let host = &provenance.host;
    let how = if provenance.is_simulated { "simulated" } else { "real processes" };
    let wake = format!("{:?}", provenance.wake);
    vec![
        format!("{} with seed {}, {how}", provenance.command.join(" "), provenance.seed),
        format!("begun {}", provenance.date),
        format!("{} build {}", provenance.versions.profile, provenance.versions.commit),
        format!("{} cores of {}, {}", provenance.cores_used, host.cpu_model, host.kernel),
        format!("wake mode {}", wake.to_lowercase()),
    ]
}

/// Why the page or a picture was not written.
#[derive(Debug, thiserror::Error)]
#[error("`{}` cannot be written: {source}; `--pictures DIR` writes elsewhere", path.display())]
pub struct PageError {
    /// What was to be written.
    pub path: PathBuf,
    /// What the system said.
    pub source: std::io::Error,
}

/// Writes a whole file under another name and moves it into place, so that nobody reads half of it.
fn replace(path: &Path, text: &str) -> std::io::Result<()> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    std::fs::write(&partial, text).and_then(|()| std::fs::rename(&partial, path))
}

#[cfg(test)]
mod tests {
    use super::{LOADS_HEADING, PAGE_FILE, PICTURES_FOLDER, Page};
    use crate::report::svg::picture::Picture;
    use crate::report::table::{Table, column};
    use crate::results::read::Missing;
    use crate::results::sample::{leave_loads, leave_run};

    fn page() -> Page {
        let mut table = Table::new(&[column("", "craft"), column("requests", "ours")]);
        table.row(vec!["<&>".to_owned(), "1.5=".to_owned()]);
        Page {
            title: "a <scenario> & more".to_owned(),
            origin: vec!["seed 7".to_owned(), "\"quoted\"".to_owned()],
            missing: vec![Missing {
                file: "trials.jsonl".to_owned(),
                what: "line 3 is torn".into(),
            }],
            tables: vec![("Table".to_owned(), table)],
            pictures: vec![Picture::of_nothing("one", "One", "<nothing>")],
            text: "as <&> seen\n".to_owned(),
        }
    }

    #[test]
    fn the_page_stands_alone_and_is_well_formed() {
        let html = page().html();
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        let document = roxmltree::Document::parse_with_options(&html, options).unwrap();
        let texts: Vec<&str> = document.descendants().filter_map(|node| node.text()).collect();
        for text in ["a <scenario> & more", "<&>", "<nothing>", "as <&> seen\n"] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
        assert!(texts.contains(&"trials.jsonl: line 3 is torn"));
        for outside in ["<script", "http", "src=", "@import", "<link"] {
            assert!(!html.contains(outside), "{outside}");
        }
        // The text of a style element is not unescaped in HTML, so it must need no escapes.
        let style = document.descendants().find(|node| node.has_tag_name("style")).unwrap();
        assert!(html.contains(style.text().unwrap()));
        assert_eq!(html, page().html());
    }

    #[test]
    fn loads_have_their_tables_on_the_page() {
        let place = tempfile::tempdir().unwrap();
        let summary = leave_loads(place.path(), 1, 2, 500, 1.2);
        let page = Page::of(&summary, Vec::new(), Vec::new(), String::new());
        let html = page.html();
        for heading in [LOADS_HEADING, "Stages, us, p99", "Under load, a needed application"] {
            assert!(html.contains(&format!("<h2>{heading}</h2>")), "{heading}");
        }
        assert!(page.tables.iter().all(|(_, table)| !table.is_empty()));
        let trials = leave_run(&place.path().join("trials"), &[2]);
        assert!(Page::of(&trials, Vec::new(), Vec::new(), String::new()).tables.is_empty());
    }

    #[test]
    fn files_are_replaced_and_a_place_that_cannot_be_written_is_named() {
        let place = tempfile::tempdir().unwrap();
        for _ in 0..2 {
            let written = page().write(place.path()).unwrap();
            let names: Vec<_> = written
                .iter()
                .map(|path| path.strip_prefix(place.path()).unwrap().to_str().unwrap())
                .collect();
            assert_eq!(names, [PAGE_FILE, &format!("{PICTURES_FOLDER}/one.svg")]);
        }
        let entries = std::fs::read_dir(place.path()).unwrap().count();
        assert_eq!(entries, 2, "nothing but the page and the folder");
        let blocked = tempfile::tempdir().unwrap();
        std::fs::write(blocked.path().join(PICTURES_FOLDER), "a file").unwrap();
        let error = page().write(blocked.path()).unwrap_err().to_string();
        assert!(error.contains(PICTURES_FOLDER) && error.contains("--pictures DIR"), "{error}");
        assert!(!blocked.path().join(PAGE_FILE).exists());
    }
}
