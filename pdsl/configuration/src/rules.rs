//! Rules across parameters: where each applies, and what is said where it is broken.

use crate::block::{Block, Content, Field, Origin};
use crate::condition::{EvaluationError, Function, Given, Reference, extreme, repeated};
use crate::model::{Rule, Value};
use rc_diagnostics::{Diagnostic, Span};

/// A rule that does not hold.
pub(crate) struct Broken<'a> {
    rule: &'a Rule,
    /// The first of the values that break it, of those that are given if there are any.
    main: Spot,
    others: Vec<Spot>,
    /// The condition and the values that break it.
    pub(crate) why: String,
}

/// One of the values that break a rule.
struct Spot {
    path: String,
    at: Span,
    origin: Origin,
    /// "is 3"
    what: String,
}

/// The rules that do not hold, each by its index, once for each element of the lists around it. One that names a
/// parameter which is itself faulty is not tried.
pub(crate) fn broken<'a>(rules: &'a [Rule], root: &Block) -> Vec<(usize, Broken<'a>)> {
    let mut all = Vec::new();
    for (at, rule) in rules.iter().enumerate() {
        each(&mut vec![root], &rule.scope, &mut |blocks| {
            all.extend(apply(rule, blocks).map(|broken| (at, broken)));
        });
    }
    all
}

/// Calls `visit` for every block that `scope` leads to, with the blocks around it, the outermost first.
fn each<'b>(blocks: &mut Vec<&'b Block>, scope: &[String], visit: &mut dyn FnMut(&[&'b Block])) {
    let Some((name, rest)) = scope.split_first() else {
        visit(blocks);
        return;
    };
    let field = blocks.last().and_then(|block| block.field(name));
    for block in field.into_iter().flat_map(Field::blocks) {
        blocks.push(block);
        each(blocks, rest, visit);
        blocks.pop();
    }
}

fn apply<'a>(rule: &'a Rule, blocks: &[&Block]) -> Option<Broken<'a>> {
    let references = rule.condition.references();
    let named: Option<Vec<Named<'_>>> = references
        .map(|(function, reference)| Named::find(function, reference, blocks))
        .collect();
    let named = named?;
    let given: Vec<Given<'_>> = named.iter().map(Named::given).collect();
    let verdict = match rule.condition.holds(&given) {
        Ok(true) => return None,
        Ok(false) => "does not hold",
        Err(EvaluationError::DivisionByZero) => "divides by zero",
        Err(EvaluationError::Overflow) => "gives a number that is too large",
        Err(EvaluationError::NotANumber) => "cannot be computed with nan, which is no number",
        Err(EvaluationError::EmptyList | EvaluationError::Malformed) => "cannot be computed",
    };
    let mut spots: Vec<Spot> = Vec::new();
    for spot in named.iter().zip(&given).flat_map(|(n, g)| n.spots(g)) {
        if spots.iter().all(|known| known.path != spot.path) {
            spots.push(spot);
        }
    }
    let values: Vec<String> = spots.iter().map(Spot::described).collect();
    let why = format!("`{}` {verdict}: {}", rule.text, values.join(", "));
    // A default has no line of its own; another value may have one.
    let origin = spots.iter().map(|spot| spot.origin).max();
    let main = spots.iter().position(|spot| Some(spot.origin) == origin);
    // A condition without parameters is refused when the `.pdsl` is read.
    let main = spots.remove(main?);
    Some(Broken {
        rule,
        main,
        others: spots,
        why,
    })
}

impl Broken<'_> {
    /// What is said to whoever wrote the configuration.
    pub(crate) fn diagnostic(self) -> Diagnostic {
        let message = format!("`{}` breaks a rule: {}", self.main.path, self.rule.message);
        let diagnostic = Diagnostic::error("rule-broken", self.main.at, message).help(self.why);
        let others = self
            .others
            .into_iter()
            .filter(|spot| spot.origin == Origin::Given);
        others.fold(diagnostic, |diagnostic, spot| {
            diagnostic.label(spot.at, format!("`{}`", spot.path))
        })
    }
}

impl Spot {
    fn described(&self) -> String {
        let default = match self.origin {
            Origin::Default => " by default",
            Origin::Kept | Origin::Given => "",
        };
        format!("`{}` {}{default}", self.path, self.what)
    }
}

/// What a reference leads to.
struct Named<'b> {
    function: Option<Function>,
    reference: &'b Reference,
    leaves: Vec<Leaf<'b>>,
    /// The list or array that a function is about, or the parameter itself.
    field: &'b Field,
    count: usize,
}

/// One value, and the element that it is of an array.
struct Leaf<'b> {
    value: &'b Value,
    field: &'b Field,
    element: Option<usize>,
}

impl<'b> Named<'b> {
    /// None where something on the way is faulty.
    fn find(
        function: Option<Function>,
        reference: &'b Reference,
        blocks: &[&'b Block],
    ) -> Option<Self> {
        let mut within: Vec<&'b Block> = vec![*blocks.get(reference.level)?];
        let (mut leaves, mut about, mut count) = (Vec::new(), None, 0);
        for name in &reference.path {
            count = 0;
            let mut inner = Vec::new();
            for block in within {
                let field = block.field(name).filter(|field| !field.faulty)?;
                match field.content.as_ref()? {
                    Content::Value(Value::Array(values)) => {
                        about = about.or(Some(field));
                        count += values.len();
                        let leaf = |(at, value)| Leaf {
                            value,
                            field,
                            element: Some(at),
                        };
                        leaves.extend(values.iter().enumerate().map(leaf));
                    }
                    Content::Value(value) => {
                        about = about.or(Some(field));
                        leaves.push(Leaf {
                            value,
                            field,
                            element: None,
                        });
                    }
                    Content::Group(block) => inner.push(block),
                    Content::List(elements) => {
                        about = about.or(Some(field));
                        count += elements.len();
                        inner.extend(elements);
                    }
                }
            }
            within = inner;
        }
        Some(Self {
            function,
            reference,
            leaves,
            field: about?,
            count,
        })
    }

    fn given(&self) -> Given<'b> {
        Given {
            values: self.leaves.iter().map(|leaf| leaf.value).collect(),
            count: self.count,
        }
    }

    /// The values that decide.
    fn spots(&self, given: &Given<'_>) -> Vec<Spot> {
        let whole = |what: &str| vec![self.field.spot(what.to_owned())];
        let leaf = |at: usize| self.leaves.get(at).map(Leaf::spot);
        match self.function {
            None => leaf(0).into_iter().collect(),
            Some(function @ (Function::Min | Function::Max)) => {
                let at = extreme(function, &given.values).and_then(leaf);
                at.map_or_else(|| whole("is empty"), |spot| vec![spot])
            }
            Some(Function::Len) => match self.reference.path.last() {
                Some(name) if *name != self.field.name => {
                    whole(&format!("has {} `{name}` in all", self.count))
                }
                _ => whole(&format!("has length {}", self.count)),
            },
            Some(Function::Unique) => match repeated(&given.values) {
                // The second one is the one too many.
                Some((first, second)) => {
                    [leaf(second), leaf(first)].into_iter().flatten().collect()
                }
                None => whole("has no value twice"),
            },
        }
    }
}

impl Leaf<'_> {
    fn spot(&self) -> Spot {
        let what = if self.field.secret {
            "is secret".to_owned()
        } else {
            format!("is {}", self.value.to_toml())
        };
        let mut spot = self.field.spot(what);
        if let Some(at) = self.element {
            spot.path.push_str(&format!("[{at}]"));
            spot.at = *self.field.elements.get(at).unwrap_or(&spot.at);
        }
        spot
    }
}

impl Field {
    /// The tables in it.
    fn blocks(&self) -> &[Block] {
        match &self.content {
            Some(Content::Group(block)) => std::slice::from_ref(block),
            Some(Content::List(elements)) => elements,
            Some(Content::Value(_)) | None => &[],
        }
    }

    fn spot(&self, what: String) -> Spot {
        Spot {
            path: self.path.clone(),
            at: self.at,
            origin: self.origin,
            what,
        }
    }
}
