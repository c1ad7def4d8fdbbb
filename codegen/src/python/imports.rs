//! The imports at the begin of generated files.

use serde::Serialize;

/// The lines of libraries, by the word that needs them: those of Python, then those of packages.
const LINES: [&[(&str, &str)]; 2] = [
    &[
        ("_abc.", "import collections.abc as _abc"),
        ("_dataclasses.", "import dataclasses as _dataclasses"),
        ("_enum.", "import enum as _enum"),
        ("_pathlib.", "import pathlib as _pathlib"),
        ("_typing.", "import typing as _typing"),
    ],
    &[
        ("_np.", "import numpy as _np"),
        ("_npt.", "import numpy.typing as _npt"),
        ("_robocomp.", "import robocomp as _robocomp"),
        ("_innermodel.", "import robocomp.innermodel as _innermodel"),
        ("_testing.", "import robocomp.testing as _testing"),
        ("_testing.", "from robocomp.testing import Fault, in_place"),
        ("_window.", "import robocomp.window as _window"),
        ("_shared.", "import robocomp.world as _shared"),
    ],
];

/// Groups of lines, with an empty line before each.
#[derive(Debug, Serialize)]
#[serde(transparent)]
pub(super) struct Imports(Vec<Vec<String>>);

impl Imports {
    /// The libraries that one of the texts or one of the words needs, then the lines of the package
    /// itself.
    pub(super) fn of(texts: &[&str], words: &[(&str, bool)], own: Vec<String>) -> Self {
        let needs = |word: &str| {
            let mut words = words.iter();
            words.any(|(own, there)| *there && *own == word)
                || texts.iter().any(|text| text.contains(word))
        };
        let libraries = LINES.iter().map(|group| {
            let lines = group.iter().filter(|(word, _)| needs(word));
            lines.map(|(_, line)| (*line).to_owned()).collect()
        });
        let groups = libraries.chain([own]);
        Self(
            groups
                .filter(|lines: &Vec<String>| !lines.is_empty())
                .collect(),
        )
    }
}
