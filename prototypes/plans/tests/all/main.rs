//! Tests of plans.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

mod bodies;
mod covariances;
mod dconv;
mod eigen;
mod functions;
mod moving;
mod networks;
mod opposites;
mod plans;
mod samples;

use rc_diagnostics::{Format, SourceMap, render};
use rc_prototypes::model::Library;
use rc_syntax::MemoryLoader;
use std::path::Path;

/// Interfaces and abstract types that most tests use.
const LIDAR: &str = r#"
module Lidar
{
    struct Point { @unit("mm") float X; @unit("mm") float Y; @unit("mm") float Z; };
    struct Cell { @unit("mm") short X; @unit("mm") short Y; @unit("mm") short Z; };
};
"#;

/// The prototypes of a text, which has no errors.
fn library(text: &str) -> Library {
    let mut sources = SourceMap::new();
    let source = sources.add("a.dproto", text);
    let loader = MemoryLoader::new([("Lidar.idsl", LIDAR)]);
    let (library, found) = rc_prototypes::load(&mut sources, &loader, &[source]);
    let found = render(&sources, &found, Format::Short);
    assert!(!found.contains("error["), "{found}");
    library
}

/// An interpreter with scipy and networkx, if they can be installed.
fn python(test: &str) -> Option<&'static Path> {
    let packages = "scipy==1.15.3\nnetworkx==3.4.2\n";
    rc_test_support::python::packages("plans", packages, test)
}
