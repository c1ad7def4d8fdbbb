//! `cargo xtask book`: the pages of `docs`, in the order of SUMMARY.md, and the API of the library
//! crates, as one folder of HTML without a server. Every link in it is checked.
//!
//! [`page`] turns Markdown into HTML, [`links`] finds links that lead nowhere.

mod links;
mod page;

use crate::build::{Build, Profile, run};
use crate::{crates, named, tree};
use page::{Page, escaped};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const USAGE: &str = "\
Writes the documentation as a book, with the API of the library crates, and checks its links.

usage: cargo xtask book [--out DIR] [--no-api]

  --out DIR   the folder (target/book), which is written anew
  --no-api    without the API, which takes minutes to compile
";

const STYLE: &str = include_str!("book/style.css");
const SCRIPT: &str = include_str!("book/search.js");
/// The file that marks a folder as one that may be written anew.
pub(crate) const MARK: &str = ".robocomp-book";
const TITLE: &str = "RoboComp in Rust";

/// Runs `cargo xtask book`.
///
/// # Errors
/// The command line is wrong, a page cannot be written, or a link leads nowhere.
pub(crate) fn run_command(words: &[String]) -> Result<(), String> {
    let (mut out, mut with_api) = (None, true);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--out" => out = Some(PathBuf::from(words.next().ok_or("--out needs a value")?)),
            "--no-api" => with_api = false,
            "--help" | "-h" => {
                print!("{USAGE}");
                return Ok(());
            }
            other => return Err(format!("unknown option `{other}`; see --help")),
        }
    }
    let build = Build::new(Profile::Dev, true)?;
    let out = match out {
        Some(out) => std::path::absolute(out).map_err(|error| error.to_string())?,
        None => build.root.join("target/book"),
    };
    let pages = write(&build, &out, with_api)?;
    println!(
        "wrote {} pages, {}",
        pages,
        out.join("index.html").display()
    );
    Ok(())
}

/// Writes the book into a folder, checks its links, and returns the number of its pages.
pub(crate) fn write(build: &Build, out: &Path, with_api: bool) -> Result<usize, String> {
    make_empty(out)?;
    let docs = build.root.join("docs");
    let summary = docs.join("SUMMARY.md");
    let summary = std::fs::read_to_string(&summary).map_err(named(&summary))?;
    let chapters = chapters(&summary);
    let mut pages = Vec::new();
    for (_, file, _) in chapters.iter().filter_map(Chapter::page) {
        let path = docs.join(file);
        let text = std::fs::read_to_string(&path).map_err(named(&path))?;
        pages.push(Page::read(file, &text));
    }
    let crates = if with_api {
        api(build, &out.join("api"))?
    } else {
        Vec::new()
    };
    let listed: Vec<_> = chapters.iter().filter_map(Chapter::page).collect();
    for (at, page) in pages.iter().enumerate() {
        let neighbour = |at: Option<usize>| listed.get(at?).map(|(title, file, _)| (*title, *file));
        let around = [neighbour(at.checked_sub(1)), neighbour(Some(at + 1))];
        let html = framed(&chapters, with_api, page, around);
        tree::write(&out.join(&page.place), html.as_bytes())?;
    }
    let contents = contents(&chapters, &crates);
    let index = framed(&chapters, with_api, &contents, [None, None]);
    tree::write(&out.join("index.html"), index.as_bytes())?;
    tree::write(&out.join("style.css"), STYLE.as_bytes())?;
    let script = format!("const places = [\n{}];\n{SCRIPT}", places(&pages));
    tree::write(&out.join("search.js"), script.as_bytes())?;
    for image in tree::files(&docs.join("images"))? {
        let place = Path::new("images").join(image);
        tree::copy(&docs.join(&place), &out.join(&place))?;
    }
    let dead = links::dead(out)?;
    if dead.is_empty() {
        return Ok(pages.len());
    }
    Err(format!("links that lead nowhere:\n{}", dead.join("\n")))
}

/// Empties the folder of an earlier book. A folder with other files stays as it is.
fn make_empty(out: &Path) -> Result<(), String> {
    if out.join(MARK).is_file() {
        std::fs::remove_dir_all(out).map_err(named(out))?;
    }
    std::fs::create_dir_all(out).map_err(named(out))?;
    let mut entries = out.read_dir().map_err(named(out))?;
    if entries.next().is_some() {
        return Err(format!(
            "{} has files and is no book: name an empty folder",
            out.display()
        ));
    }
    tree::write(&out.join(MARK), b"")
}

/// A line of SUMMARY.md.
enum Chapter<'a> {
    Part(&'a str),
    /// Title, file, and depth.
    Page(&'a str, &'a str, usize),
}

impl<'a> Chapter<'a> {
    fn page(&self) -> Option<(&'a str, &'a str, usize)> {
        match self {
            Self::Part(_) => None,
            Self::Page(title, file, depth) => Some((title, file, *depth)),
        }
    }
}

fn chapters(summary: &str) -> Vec<Chapter<'_>> {
    let lines = summary.lines().filter_map(|line| {
        if let Some(part) = line.strip_prefix("# ") {
            return (part != "Summary").then_some(Chapter::Part(part));
        }
        let depth = line.find("- [")?;
        let (title, rest) = line[depth + 3..].split_once("](")?;
        Some(Chapter::Page(title, rest.strip_suffix(')')?, depth / 4))
    });
    lines.collect()
}

/// The text of a title as HTML. Titles have no Markdown but code.
fn title(text: &str) -> String {
    escaped(&text.replace('`', ""))
}

/// The list of all chapters, with links from a page `above` folders below the root.
fn list(chapters: &[Chapter<'_>], above: &str, current: &str) -> String {
    let mut html = String::new();
    for chapter in chapters {
        let _ = match chapter {
            Chapter::Part(name) => writeln!(html, "<h2>{}</h2>", escaped(name)),
            Chapter::Page(name, file, depth) => {
                let here = if *file == current {
                    " aria-current=\"page\""
                } else {
                    ""
                };
                writeln!(
                    html,
                    "<a class=\"depth{depth}\" href=\"{above}{}\"{here}>{}</a>",
                    page::place(file),
                    title(name)
                )
            }
        };
    }
    html
}

/// A whole file: the page between the list of chapters and the links to its neighbours.
fn framed(
    chapters: &[Chapter<'_>],
    with_api: bool,
    page: &Page,
    neighbours: [Option<(&str, &str)>; 2],
) -> String {
    let above = "../".repeat(page.place.matches('/').count());
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{} - {TITLE}</title>\n\
         <link rel=\"stylesheet\" href=\"{above}style.css\">\n\
         <script src=\"{above}search.js\" data-root=\"{above}\" defer></script>\n</head>\n<body>\n\
         <nav>\n<a class=\"title\" href=\"{above}index.html\">{TITLE}</a>\n\
         <input type=\"search\" placeholder=\"Search headings\" aria-label=\"Search headings\">\n<div id=\"found\"></div>\n",
        escaped(&page.title)
    );
    html += &list(chapters, &above, &page.file);
    if with_api {
        let _ = writeln!(
            html,
            "<h2>API</h2>\n<a href=\"{above}index.html#api\">Library crates</a>"
        );
    }
    let _ = writeln!(html, "</nav>\n<main>\n{}", page.html);
    html += "<footer>";
    for (neighbour, (word, class)) in neighbours
        .iter()
        .zip([("Previous", "previous"), ("Next", "next")])
    {
        if let Some((name, file)) = neighbour {
            let _ = write!(
                html,
                "<a class=\"{class}\" href=\"{above}{}\">{word}: {}</a>",
                page::place(file),
                title(name)
            );
        }
    }
    html + "</footer>\n</main>\n</body>\n</html>\n"
}

/// The first page.
fn contents(chapters: &[Chapter<'_>], crates: &[(String, String)]) -> Page {
    let mut html = format!("<h1>{TITLE}</h1>\n<div class=\"contents\">\n");
    html += &list(chapters, "", "");
    html += "</div>\n";
    if !crates.is_empty() {
        html += "<h2 id=\"api\">Library crates</h2>\n<table>\n";
        for (name, description) in crates {
            let _ = writeln!(
                html,
                "<tr><td><a href=\"api/{}/index.html\"><code>{name}</code></a></td><td>{}</td></tr>",
                name.replace('-', "_"),
                escaped(description)
            );
        }
        html += "</table>\n";
    }
    Page {
        file: String::new(),
        place: "index.html".to_owned(),
        title: "Contents".to_owned(),
        headings: Vec::new(),
        html,
    }
}

/// What the search finds: heading, page, and address, as elements of a list of JavaScript.
fn places(pages: &[Page]) -> String {
    let mut all = String::new();
    for page in pages {
        for (text, anchor) in &page.headings {
            let place = format!("{}#{anchor}", page.place);
            let line = serde_json::json!([text, page.title, place]);
            let _ = writeln!(all, "{line},");
        }
    }
    all
}

/// Writes the API of the library crates, and returns their names with what they are for.
fn api(build: &Build, out: &Path) -> Result<Vec<(String, String)>, String> {
    let crates = crates::described(build)?;
    // Rustdoc adds to the folder, which may have other crates. `target/doc` is that of the user.
    let target = build.target.join("api");
    let made = target.join("doc");
    if made.exists() {
        std::fs::remove_dir_all(&made).map_err(named(&made))?;
    }
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut cargo = Command::new(cargo);
    cargo.args(["doc", "--no-deps", "--locked", "--lib"]);
    cargo.arg("--target-dir").arg(&target);
    // What is compiled stays where other commands find it.
    cargo.env("CARGO_BUILD_BUILD_DIR", &build.target);
    for (name, _) in &crates {
        cargo.args(["--package", name]);
    }
    // A link that leads nowhere.
    cargo.env("RUSTDOCFLAGS", "-D rustdoc::broken_intra_doc_links");
    run(cargo.current_dir(&build.root))?;
    for file in tree::files(&made)? {
        if file != Path::new(".lock") {
            tree::copy(&made.join(&file), &out.join(&file))?;
        }
    }
    Ok(crates)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_other_files_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("mine"), "").expect("a file");
        let told = make_empty(folder.path()).expect_err("no book");
        assert!(told.contains("is no book"), "{told}");
        assert!(folder.path().join("mine").exists());
        let book = folder.path().join("book");
        make_empty(&book).expect("a new folder");
        std::fs::write(book.join("old.html"), "").expect("a file");
        make_empty(&book).expect("an old book");
        assert!(!book.join("old.html").exists());
    }
}
