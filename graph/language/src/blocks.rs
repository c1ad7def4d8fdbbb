//! Attributes that hold data prototypes, and conversions between them.

use graph_schema::{Attribute, Block, Conversion, Kind, Number, Program};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_plans::{Refusal, between};
use rc_prototypes::model::{Content, Library, Prototype};
use rc_syntax::{MemoryLoader, Name};
use std::collections::HashMap;
use std::sync::Arc;

/// How many attributes may have one value: each converts into each.
pub(crate) const MOST: usize = 8;

/// A pose as transforms have it, in the axes of the other prototype.
const POSE: &str = "
algebraic xyz :: Scalar{x, y, z}
algebraic turns :: Vector{3}
dproto translation :: geometry
{
    semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]}
    dr = { 0 = x, 1 = y, 2 = z }
}
dproto angles :: geometry
{
    semantic = Orientation coord = euler_xyz_moving algebraic = turns ddr = :: c99{double[3]}
    dr = { 0 = 0, 1 = 1, 2 = 2 }
}
dproto pose :: geometry
{
    semantic = Pose composes = { Position = translation, Orientation = angles }
}
";

/// The prototypes that attributes may have.
pub(crate) struct Blocks<'l> {
    /// `None` if the files have errors: then their declarations are not checked.
    library: Option<&'l Library>,
    /// The plans from one prototype to another one.
    plans: HashMap<(String, String), Result<Program, (&'static str, String)>>,
}

impl<'l> Blocks<'l> {
    pub(crate) fn new(library: Option<&'l Library>) -> Self {
        Self {
            library,
            plans: HashMap::new(),
        }
    }

    /// The type of an attribute with a prototype.
    pub(crate) fn block(&self, name: &Name, found: &mut Diagnostics) -> Kind {
        let mut made = Block {
            prototype: name.text.clone(),
            meaning: String::new(),
            numbers: Vec::new(),
            is_sequence: false,
            check: Program::default(),
            pose: None,
            consistent_with: None,
            conversions: Vec::new(),
        };
        let Some(library) = self.library else {
            return Kind::Block(made.into());
        };
        let Some(prototype) = library.prototype(&name.text) else {
            let message = format!("unknown prototype `{}`", name.text);
            let known = library.prototypes.iter().map(|own| own.name.as_str());
            let diagnostic = Diagnostic::error("unknown-prototype", name.span, message);
            found.push(if library.prototypes.is_empty() {
                diagnostic.help("import a `.dproto` file that declares it")
            } else {
                diagnostic.suggest(&name.text, known)
            });
            return Kind::Block(made.into());
        };
        let mut error = |message: String| {
            found.push(Diagnostic::error("wrong-type", name.span, message));
        };
        made.is_sequence = prototype.sequence.is_some();
        if made.is_sequence && prototype.covariance.is_some() {
            error(format!(
                "`{}` has both a sequence and a covariance",
                name.text
            ));
        }
        if has_sequence_inside(library, prototype) {
            error(format!("a part of `{}` is a sequence", name.text));
        }
        match rc_plans::block(library, &name.text) {
            Ok(block) => {
                let numbers = block.numbers.into_iter().map(|number| Number {
                    name: number.name,
                    unit: number.unit,
                    number: number.number,
                });
                made.numbers = numbers.collect();
                made.meaning = block.meaning;
                made.check = block.check;
                if (&*prototype.domain, &*prototype.semantic) == ("geometry", "Pose")
                    && !made.is_sequence
                {
                    made.pose = Self::pose(library, &name.text);
                }
            }
            // An error in a prototype is a finding of its file.
            Err(Refusal::Unknown(_)) => {}
            Err(refusal) => error(refusal.to_string()),
        }
        Kind::Block(made.into())
    }

    /// The formula from a prototype to the poses of transforms.
    fn pose(library: &Library, name: &str) -> Option<Program> {
        let mut sources = SourceMap::new();
        let source = sources.add("pose.dproto", POSE);
        let own = rc_prototypes::load(&mut sources, &MemoryLoader::default(), &[source]).0;
        let plan = between((library, name), (&own, "pose")).ok()?;
        Some(plan.program)
    }

    /// The formula from one prototype to another one, or the code of a finding and the reason.
    fn plan(
        &mut self,
        library: &Library,
        from: &Block,
        to: &Block,
    ) -> Result<Program, (&'static str, String)> {
        let ends = (from.prototype.clone(), to.prototype.clone());
        if let Some(known) = self.plans.get(&ends) {
            return known.clone();
        }
        let plan = if from.is_sequence == to.is_sequence {
            between((library, &ends.0), (library, &ends.1))
        } else {
            Err(Refusal::Sequence)
        };
        let wrong = |refusal: &Refusal| (refusal.code(), refusal.to_string());
        let made = plan.map_err(|refusal| wrong(&refusal)).and_then(|plan| {
            // A reader of one attribute would not get the value that was set as the other one.
            match plan.lost.iter().find(|loss| !loss.is_bounded()) {
                Some(loss) => Err(("conversion-loses", loss.to_string())),
                None => Ok(plan.program),
            }
        });
        self.plans.insert(ends, made.clone());
        made
    }

    /// Sets the conversions between all attributes that are one value. Each that does not convert
    /// is the name of an attribute with the finding.
    pub(crate) fn convert(
        &mut self,
        attributes: &mut [Attribute],
    ) -> Vec<(String, &'static str, String)> {
        let mut wrong = Vec::new();
        let Some(library) = self.library else {
            return wrong;
        };
        let mut same: HashMap<String, Vec<usize>> = HashMap::new();
        for (at, attribute) in attributes.iter().enumerate() {
            let value = attribute.value_of().to_owned();
            same.entry(value).or_default().push(at);
        }
        for head in 0..attributes.len() {
            if attributes[head].value_of() != attributes[head].name {
                continue;
            }
            let same = same.get(&attributes[head].name);
            // Their number is a finding already.
            let Some(same) = same.filter(|same| (2..=MOST).contains(&same.len())) else {
                continue;
            };
            let mut group: Vec<(usize, Arc<Block>)> = Vec::new();
            // The one that the others name comes first.
            let others = same.iter().copied().filter(|at| *at != head);
            for at in [head].into_iter().chain(others) {
                let Kind::Block(block) = &attributes[at].kind else {
                    continue;
                };
                // An unknown prototype is a finding of its own.
                if library.prototype(&block.prototype).is_none() {
                    continue;
                }
                let refused = group.iter().find_map(|(_, other)| {
                    let one = self.plan(library, other, block).err();
                    one.map(|why| (why, other, block)).or_else(|| {
                        let why = self.plan(library, block, other).err()?;
                        Some((why, block, other))
                    })
                });
                if let Some(((code, why), from, to)) = refused {
                    let (one, two) = (&from.prototype, &to.prototype);
                    let message = format!("`{one}` does not convert into `{two}`: {why}");
                    wrong.push((attributes[at].name.clone(), code, message));
                } else {
                    group.push((at, Arc::clone(block)));
                }
            }
            for (at, block) in &group {
                let others = group.iter().filter(|(other, _)| other != at);
                let conversions = others.filter_map(|(other, to)| {
                    Some(Conversion {
                        to: attributes[*other].name.clone(),
                        program: self.plan(library, block, to).ok()?,
                    })
                });
                let conversions: Vec<Conversion> = conversions.collect();
                if let Kind::Block(own) = &mut attributes[*at].kind {
                    Arc::make_mut(own).conversions = conversions;
                }
            }
        }
        wrong
    }
}

/// Whether a prototype has a part that is a sequence.
fn has_sequence_inside(library: &Library, prototype: &Prototype) -> bool {
    let Content::Parts(parts) = &prototype.content else {
        return false;
    };
    parts.iter().any(|part| {
        let part = library.prototype(&part.prototype);
        part.is_some_and(|p| p.sequence.is_some() || has_sequence_inside(library, p))
    })
}
