//! The parameters of a file, of a group or of a list by name: a file may have thousands, and as many
//! rules that name them.

use rc_configuration::model::{Kind, Parameter};
use std::collections::HashMap;

/// The parameters of one block.
pub(crate) struct Block<'m> {
    /// In the order of their declaration.
    pub(crate) parameters: &'m [Parameter],
    names: HashMap<&'m str, &'m Parameter>,
    inner: HashMap<&'m str, Self>,
}

impl<'m> Block<'m> {
    pub(crate) fn new(parameters: &'m [Parameter]) -> Self {
        let (mut names, mut inner) = (HashMap::new(), HashMap::new());
        for parameter in parameters {
            let name = parameter.name.as_str();
            names.entry(name).or_insert(parameter);
            if let Kind::Group(parameters) | Kind::List { parameters, .. } = &parameter.kind {
                inner.entry(name).or_insert_with(|| Self::new(parameters));
            }
        }
        Self {
            parameters,
            names,
            inner,
        }
    }

    pub(crate) fn parameter(&self, name: &str) -> Option<&'m Parameter> {
        self.names.get(name).copied()
    }

    /// The block of a group or a list.
    pub(crate) fn inner(&self, name: &str) -> Option<&Self> {
        self.inner.get(name)
    }
}
