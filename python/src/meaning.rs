//! Data prototypes: their files, and the conversions of rows of numbers.

use crate::errors;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rc_codegen::FileLoader;
use rc_conversion::{Fault, Item};
use rc_diagnostics::{Format, Severity, SourceMap, nearest, render};
use rc_plans::{Network, Program};
use rc_prototypes::model::{Content, Library, Prototype};
use rc_vocabulary::Primitive;
use std::path::PathBuf;

/// The key of a prototype: its name, the language of its type, the type, its meaning, and the
/// member whose elements are values.
type Described = (String, String, String, String, Option<String>);

/// The bytes before the first row: the number of rows, and what aligns the rows.
const HEAD: usize = 8;

/// The exception for prototypes and values that do not convert.
fn refused(py: Python<'_>, code: &str, message: &str) -> PyErr {
    let raised = errors::raise(py, "ConversionError", message);
    // Without the attribute, the message still has the reason.
    let _ = raised.value(py).setattr("code", code);
    raised
}

/// The prototypes of files.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Prototypes {
    library: Library,
    /// Prototypes about one element of a sequence: a plan converts values and elements alike.
    elements: Library,
}

impl Prototypes {
    fn known(&self, py: Python<'_>, name: &str) -> PyResult<&Prototype> {
        self.library.prototype(name).ok_or_else(|| {
            let names = || self.library.prototypes.iter().map(|of| of.name.as_str());
            let near = nearest(name, names());
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            let message = format!("the files have no prototype `{name}`{near}");
            refused(py, "unknown-prototype", &message)
        })
    }
}

#[pymethods]
impl Prototypes {
    /// Reads files with all that they import.
    #[new]
    fn new(py: Python<'_>, files: Vec<PathBuf>) -> PyResult<Self> {
        let (mut sources, mut texts) = (SourceMap::new(), Vec::new());
        for file in files {
            let text = rc_files::read(&file);
            let text = text.map_err(|error| {
                let message = format!("{}: {error}", file.display());
                pyo3::exceptions::PyOSError::new_err(message)
            })?;
            texts.push(sources.add(&file, text));
        }
        let (library, found) = rc_prototypes::load(&mut sources, &FileLoader::new(&[]), &texts);
        if let Some(first) = found.iter().find(|one| one.severity == Severity::Error) {
            let text = render(&sources, &found, Format::Human);
            return Err(refused(py, first.code, text.trim_end()));
        }
        Ok(Self {
            elements: library.of_elements(),
            library,
        })
    }

    /// All prototypes.
    fn all(&self) -> Vec<Described> {
        let described = |of: &Prototype| {
            let (language, ty) = match &of.content {
                Content::Values { language, ty, .. } => (language.clone(), ty.clone()),
                Content::Parts(_) => match &of.composite {
                    Some(ty) => ("IDSL".to_owned(), ty.clone()),
                    None => (String::new(), String::new()),
                },
            };
            let semantic = format!("{}::{}", of.domain, of.semantic);
            (of.name.clone(), language, ty, semantic, of.sequence.clone())
        };
        self.library.prototypes.iter().map(described).collect()
    }

    /// The cheapest conversion of one prototype into another one.
    fn conversion(&self, py: Python<'_>, from: &str, to: &str) -> PyResult<Conversion> {
        let (own, wanted) = (self.known(py, from)?, self.known(py, to)?);
        let no = |code: &str, reason: &str| {
            let message = format!("`{from}` does not convert into `{to}`: {reason}");
            refused(py, code, &message)
        };
        let plan = Network::new(&self.elements).plan(from, to);
        let plan = plan.map_err(|refusal| no(refusal.code(), &refusal.to_string()))?;
        if let Some(function) = plan.program.functions().next() {
            let reason = format!("the function `{function}` would have to convert");
            return Err(no("no-conversion", &reason));
        }
        let [ours, theirs] = &plan.covariances;
        let members = |of: &Prototype, covariances: &[(String, usize)]| {
            let members = self.library.members(of, covariances);
            members.ok_or_else(|| {
                let reason = format!("`{}` does not say which members hold its parts", of.name);
                no("no-conversion", &reason)
            })
        };
        let (input, output) = (members(own, ours)?, members(wanted, theirs)?);
        let width = input.len().max(output.len());
        let places = |count: usize| (0..).take(count).map(Some).collect::<Vec<Option<u32>>>();
        let formula = plan.formula((&places(input.len()), &places(output.len())), width, 0);
        let marked = Item::Marked(u32::try_from(width).unwrap_or(u32::MAX), Primitive::F64);
        let group = Item::Group {
            items: vec![marked],
            formula,
        };
        // They would stay in axes and units that the rest has no more.
        let dropped = self.library.covariances(own).into_iter();
        let dropped = dropped.filter(|of| ours.iter().all(|(part, _)| *part != of.part));
        Ok(Conversion {
            rows: rc_conversion::Program::new(&[Item::Sequence(vec![group])]),
            width,
            from: input.into_iter().map(|datum| datum.member).collect(),
            to: output
                .into_iter()
                .map(|datum| {
                    let number = datum.number.map(|number| number.word().to_owned());
                    (datum.member, number)
                })
                .collect(),
            dropped: dropped.filter_map(|of| of.member).collect(),
            formula: plan.program,
        })
    }
}

/// The conversion of rows of numbers of one prototype into those of another one.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Conversion {
    /// The members with covariances of the first prototype that are not converted.
    #[pyo3(get)]
    dropped: Vec<String>,
    /// The numbers of a row: as many as the prototype with more of them has.
    #[pyo3(get)]
    width: usize,
    /// The members with the numbers of the first prototype.
    #[pyo3(get, name = "from_")]
    from: Vec<String>,
    /// Those of the second one, with the types of their numbers where they are known.
    #[pyo3(get)]
    to: Vec<(String, Option<String>)>,
    rows: rc_conversion::Program,
    formula: Program,
}

#[pymethods]
impl Conversion {
    /// Converts rows of `float64`. They begin with the numbers of the first prototype, and end up as
    /// rows that begin with those of the second one. `first` is the number of the first row.
    fn convert<'py>(
        &self,
        py: Python<'py>,
        rows: &[u8],
        first: usize,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let size = 8 * self.width;
        let count = rows.len().checked_div(size).unwrap_or(0);
        let Some(number) = u32::try_from(count)
            .ok()
            .filter(|_| count * size == rows.len())
        else {
            let message = format!(
                "{} bytes are not rows of {} numbers",
                rows.len(),
                self.width
            );
            return Err(pyo3::exceptions::PyValueError::new_err(message));
        };
        let mut bytes = Vec::with_capacity(HEAD + rows.len());
        bytes.extend(number.to_le_bytes());
        bytes.resize(HEAD, 0);
        bytes.extend(rows);
        match self.rows.run(&mut bytes, 0) {
            Ok(_) => Ok(PyBytes::new(py, &bytes[HEAD..])),
            Err(fault) => Err(self.refusal(py, fault, rows, first)),
        }
    }
}

impl Conversion {
    /// The exception for the row of a fault.
    fn refusal(&self, py: Python<'_>, fault: Fault, rows: &[u8], first: usize) -> PyErr {
        let row = fault.at().saturating_sub(HEAD) / (8 * self.width).max(1);
        let numbers: Vec<f64> = rows
            .chunks_exact(8)
            .skip(row * self.width)
            .take(self.from.len())
            .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap_or_default()))
            .collect();
        // The formula of the plan knows which number it refuses.
        let reason = match self.formula.run(&numbers) {
            Err(rejected) => rejected.to_string(),
            Ok(_) => "a number does not fit its type".to_owned(),
        };
        let place = first + row;
        let raised = refused(
            py,
            "bad-value",
            &format!("value {place} is refused: {reason}"),
        );
        // Without the attribute, the message still has the place.
        let _ = raised.value(py).setattr("index", place);
        raised
    }
}
