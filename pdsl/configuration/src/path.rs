//! Paths of parameters in messages and commands: `motors[2].max`.

use crate::block::{Block, Content, Field, inner};
use crate::model::{Kind, Parameter, Value};
use rc_diagnostics::{Diagnostic, Span};

/// The target of a path. Blocks have their fields in the order of the model, so the indices are
/// valid in all blocks of one model.
pub(crate) struct Target<'m> {
    pub(crate) parameter: &'m Parameter,
    /// The path, as messages write it.
    pub(crate) path: String,
    /// The index of each field on the path, and of the element if the field is a list. The last
    /// step has no element.
    indices: Vec<(usize, Option<usize>)>,
    /// The element of an array.
    pub(crate) element: Option<usize>,
}

impl Target<'_> {
    /// Whether both targets share a value.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        let (a, b) = (self.element, other.element);
        self.indices == other.indices && (a == b || a.is_none() || b.is_none())
    }

    /// The field in `root`; `None` in a block of another model.
    pub(crate) fn field<'b>(&self, root: &'b Block) -> Option<&'b Field> {
        let (&(last, _), before) = self.indices.split_last()?;
        let mut block = root;
        for (field, element) in before {
            block = match (block.fields.get(*field)?.content.as_ref()?, element) {
                (Content::Group(block), _) => block,
                (Content::List(blocks), Some(at)) => blocks.get(*at)?,
                _ => return None,
            };
        }
        block.fields.get(last)
    }

    /// The mutable field in `root`.
    pub(crate) fn field_mut<'b>(&self, root: &'b mut Block) -> Option<&'b mut Field> {
        let (&(last, _), before) = self.indices.split_last()?;
        let mut block = root;
        for (field, element) in before {
            block = match (block.fields.get_mut(*field)?.content.as_mut()?, element) {
                (Content::Group(block), _) => block,
                (Content::List(blocks), Some(at)) => blocks.get_mut(*at)?,
                _ => return None,
            };
        }
        block.fields.get_mut(last)
    }

    /// The value in `root`: that of the parameter, or of the element of an array.
    pub(crate) fn value<'b>(&self, root: &'b Block) -> Option<&'b Value> {
        let Some(Content::Value(value)) = &self.field(root)?.content else {
            return None;
        };
        match self.element {
            Some(at) => value.as_array()?.get(at),
            None => Some(value),
        }
    }
}

/// Resolves `path` among `parameters`, whose values are in `root`. The error explains what is
/// wrong.
pub(crate) fn resolve<'m>(
    path: &str,
    mut parameters: &'m [Parameter],
    root: &Block,
    at: Span,
) -> Result<Target<'m>, Diagnostic> {
    let unknown = |message: String| Diagnostic::error("unknown-parameter", at, message);
    let Some(steps) = parse(path) else {
        let message = format!("`{path}` is not the path of a parameter");
        return Err(unknown(message).help("a path looks like `safe_distance` or `motors[2].max`"));
    };
    let mut block = Some(root);
    let (mut indices, mut resolved) = (Vec::new(), String::new());
    let count = steps.len();
    for (number, (name, index)) in steps.into_iter().enumerate() {
        let is_last = number + 1 == count;
        let Some(position) = parameters.iter().position(|p| p.name == name) else {
            let diagnostic = unknown(format!("unknown parameter `{}`", inner(&resolved, name)));
            return Err(if parameters.is_empty() {
                diagnostic.help("there are no parameters here")
            } else {
                diagnostic.suggest(name, parameters.iter().map(|p| p.name.as_str()))
            });
        };
        let parameter = &parameters[position];
        resolved = inner(&resolved, name);
        let content = block.and_then(|block| block.fields.get(position)?.content.as_ref());
        let length = match content {
            Some(Content::List(blocks)) => Some(blocks.len()),
            Some(Content::Value(Value::Array(values))) => Some(values.len()),
            _ => None,
        };
        match (index, length) {
            (Some(index), Some(length)) if index >= length => {
                let diagnostic = unknown(format!("there is no `{resolved}[{index}]`"));
                return Err(diagnostic.help(match length {
                    0 => format!("`{resolved}` is empty"),
                    1 => format!("there is only `{resolved}[0]`"),
                    _ => format!(
                        "allowed are `{resolved}[0]` to `{resolved}[{}]`",
                        length - 1
                    ),
                }));
            }
            (Some(_), None) => {
                let diagnostic = unknown(format!("`{resolved}` has no elements"));
                return Err(diagnostic.help(format!("it is {}", parameter.allowed())));
            }
            _ => {}
        }
        match (&parameter.kind, content) {
            (Kind::Scalar { .. }, _) if !is_last => {
                let diagnostic = unknown(format!("`{resolved}` has no parts"));
                return Err(diagnostic.help(format!("it is {}", parameter.allowed())));
            }
            (Kind::List { .. }, _) if !is_last && index.is_none() => {
                let diagnostic = unknown(format!("`{resolved}` is a list"));
                return Err(diagnostic.help(format!("name one of its elements: `{resolved}[0]`")));
            }
            (Kind::Group(members), Some(Content::Group(inner))) => {
                (parameters, block) = (members, Some(inner));
            }
            (
                Kind::List {
                    parameters: members,
                    ..
                },
                Some(Content::List(blocks)),
            ) => {
                (parameters, block) = (members, index.and_then(|index| blocks.get(index)));
            }
            _ => {}
        }
        if let Some(index) = index {
            resolved.push_str(&format!("[{index}]"));
        }
        if is_last {
            let is_scalar = matches!(parameter.kind, Kind::Scalar { .. });
            indices.push((position, if is_scalar { None } else { index }));
            return Ok(Target {
                parameter,
                path: resolved,
                indices,
                element: index.filter(|_| is_scalar),
            });
        }
        indices.push((position, index));
    }
    // A path has at least one step.
    Err(unknown(format!("unknown parameter `{path}`")))
}

/// Parses the names of a path, each with its index.
fn parse(path: &str) -> Option<Vec<(&str, Option<usize>)>> {
    let step = |step| {
        let Some((name, rest)) = str::split_once(step, '[') else {
            return Some((step, None));
        };
        let index = rest.strip_suffix(']')?;
        let digits = !index.is_empty() && index.bytes().all(|b| b.is_ascii_digit());
        Some((name, Some(index.parse().ok().filter(|_| digits)?)))
    };
    let steps: Option<Vec<_>> = path.split('.').map(step).collect();
    steps.filter(|steps| steps.iter().all(|(name, _)| !name.is_empty()))
}
