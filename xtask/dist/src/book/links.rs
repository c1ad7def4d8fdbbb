//! Links of a folder of HTML that lead nowhere: to no file of the folder, or to no element of one.

use crate::{named, tree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// The values of an attribute in a text of HTML.
fn values<'a>(html: &'a str, attribute: &str) -> impl Iterator<Item = &'a str> {
    let begin = format!(" {attribute}=\"");
    let starts: Vec<usize> = html
        .match_indices(&begin)
        .map(|(at, _)| at + begin.len())
        .collect();
    starts
        .into_iter()
        .filter_map(|at| html[at..].split('"').next())
}

/// A path without `..`. `None` if it leaves the folder.
fn plain(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => plain = plain.parent()?.to_path_buf(),
            Component::Normal(part) => plain.push(part),
            _ => {}
        }
    }
    Some(plain)
}

/// All links that lead nowhere, as `PAGE: LINK`. Rustdoc checks those of the API.
pub(super) fn dead(folder: &Path) -> Result<Vec<String>, String> {
    let files = tree::files(folder)?;
    let own = files.iter().filter(|file| {
        file.extension().is_some_and(|ending| ending == "html") && !file.starts_with("api")
    });
    let mut pages = BTreeMap::new();
    for file in own {
        let path = folder.join(file);
        let text = std::fs::read_to_string(&path).map_err(named(&path))?;
        pages.insert(file, text);
    }
    let ids: BTreeMap<&Path, BTreeSet<&str>> = pages
        .iter()
        .map(|(file, text)| (file.as_path(), values(text, "id").collect()))
        .collect();
    let mut dead = Vec::new();
    for (file, text) in &pages {
        for target in ["href", "src"].iter().flat_map(|name| values(text, name)) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
            let parent = file.parent().unwrap_or(Path::new(""));
            let place = if path.is_empty() {
                Some((*file).clone())
            } else {
                plain(&parent.join(path))
            };
            let is_alive = place.is_some_and(|place| {
                let ids = ids.get(place.as_path());
                let has_anchor = ids.is_some_and(|ids| ids.contains(anchor));
                files.contains(&place) && (anchor.is_empty() || has_anchor)
            });
            if !is_alive {
                dead.push(format!("{}: {target}", file.display()));
            }
        }
    }
    Ok(dead)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_dead_link_is_found() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        std::fs::create_dir(root.join("in")).expect("a folder");
        let page = "<h1 id=\"top\"><a href=\"../b.html#there\">x</a> <a href=\"#top\">x</a> <a href=\"https://x.org\">x</a>\
                    <img src=\"../gone.svg\"> <a href=\"../b.html#gone\">x</a> <a href=\"#gone\">x</a> <a href=\"../../b.html\">x</a>";
        std::fs::write(root.join("in/a.html"), page).expect("a page");
        std::fs::write(root.join("b.html"), "<p id=\"there\">").expect("a page");
        let mut dead = dead(root).expect("pages");
        dead.sort();
        assert_eq!(
            dead,
            [
                "in/a.html: #gone",
                "in/a.html: ../../b.html",
                "in/a.html: ../b.html#gone",
                "in/a.html: ../gone.svg"
            ]
        );
    }
}
