//! The declarations of a `.dproto` file and its imports, with all names resolved.

use rc_diagnostics::Span;
use rc_vocabulary::Primitive;
use serde::{Serialize, Serializer};

/// The declarations of a file and of all that it imports.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Library {
    /// Domains besides `geometry`.
    pub domains: Vec<Domain>,
    /// Axes.
    pub axes: Vec<NamedAxes>,
    /// Abstract types.
    pub algebraics: Vec<Algebraic>,
    /// Abstract types with the same meaning.
    pub aliases: Vec<Alias>,
    /// Prototypes.
    pub prototypes: Vec<Prototype>,
    /// Parts of prototypes whose coordinates hold several meanings.
    pub views: Vec<View>,
    /// Conversions by functions.
    pub conversions: Vec<Conversion>,
}

/// `domain NAME :: { … }`
#[derive(Clone, Debug, Serialize)]
pub struct Domain {
    /// The name.
    pub name: String,
    /// The meanings that its values may have.
    pub semantics: Vec<String>,
    /// Coordinates of its values.
    pub coordinates: Vec<String>,
}

/// `axes NAME :: right, ahead, up`
#[derive(Clone, Debug, Serialize)]
pub struct NamedAxes {
    /// The name.
    pub name: String,
    /// The directions of x, y and z.
    pub directions: String,
    /// Whether they are a right-handed system.
    pub is_right_handed: bool,
}

/// The names of the values of an abstract type.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Algebraic {
    /// The name.
    pub name: String,
    /// The names of the values, in order: `x`, `0`, `{0,1}`.
    pub symbols: Vec<String>,
}

/// `alias LEFT <-> RIGHT { … }`
#[derive(Clone, Debug, Serialize)]
pub struct Alias {
    /// An abstract type.
    pub left: String,
    /// The other one.
    pub right: String,
    /// The values that are equal.
    pub pairs: Vec<(String, String)>,
}

/// `dproto NAME :: DOMAIN { … }`
#[derive(Clone, Debug, Serialize)]
pub struct Prototype {
    /// The name.
    pub name: String,
    /// Its place.
    #[serde(skip)]
    pub span: Span,
    /// The domain.
    pub domain: String,
    /// Its meaning.
    pub semantic: String,
    /// The type of an interface that holds the parts of a composite: `Module::Name`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub composite: Option<String>,
    /// Its values, or its parts.
    pub content: Content,
    /// The name of its axes.
    pub axes: Option<String>,
    /// The name of the axes of the body whose rotation it is, if they are others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Names of frames, or members with them: `of`, `with_respect_to`, `stamp`.
    pub frames: Vec<(String, String)>,
    /// The member whose elements are values.
    pub sequence: Option<String>,
    /// The covariance.
    pub covariance: Option<Covariance>,
    /// How far the norm of a quaternion may be from 1.
    pub tolerance: Option<f64>,
    /// The relative error that a conversion may have.
    pub loss: Option<f64>,
}

/// The contents of a prototype.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Content {
    /// Numbers of one type.
    Values {
        /// The coordinates.
        coordinate: String,
        /// The abstract type.
        algebraic: String,
        /// The language of the type.
        language: String,
        /// The type.
        ty: String,
        /// Its numbers, in the order of the abstract type.
        data: Vec<Datum>,
    },
    /// Other prototypes: the name of the part, the prototype, and the member that holds it.
    Parts(Vec<Part>),
}

/// A number of a type.
#[derive(Clone, Debug, Serialize)]
pub struct Datum {
    /// Its name in the abstract type.
    pub symbol: String,
    /// Which of its coordinates it is: `x`, or its place where these are a matrix. In domains other
    /// than `geometry`, its name in the abstract type.
    pub role: String,
    /// Its place in the type.
    pub member: String,
    /// Its unit.
    pub unit: Option<String>,
    /// How it is stored, where that is known: for types of interfaces, and of C.
    #[serde(serialize_with = "word")]
    pub number: Option<Primitive>,
    /// Whether the type holds the opposite of the number: `YGyr = -y`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_opposite: bool,
}

#[expect(
    clippy::ref_option,
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes it so"
)]
fn word<S: Serializer>(number: &Option<Primitive>, to: S) -> Result<S::Ok, S::Error> {
    number.map(Primitive::word).serialize(to)
}

/// A part of a composite.
#[derive(Clone, Debug, Serialize)]
pub struct Part {
    /// The name in the domain.
    pub name: String,
    /// The prototype.
    pub prototype: String,
    /// The member that holds it, where one is named. Empty if the type of the whole itself does.
    pub member: Option<String>,
}

/// The covariance of a prototype.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Covariance {
    /// The member with the matrix, one row after the other.
    pub member: String,
    /// The order of its rows.
    pub order: Option<String>,
    /// Whether its turns are about the fixed or the moving axes.
    pub rotation: Option<String>,
    /// How its numbers are stored, where it is an array of numbers of an interface.
    #[serde(serialize_with = "word", skip_serializing_if = "Option::is_none")]
    pub number: Option<Primitive>,
}

/// A covariance of a prototype or of one of its parts.
#[derive(Clone, Debug)]
pub struct PlacedCovariance<'l> {
    /// The names of the part and of those around it, with dots. Empty for the whole.
    pub part: String,
    /// The member of the type of the whole that holds it, if the composites say where their parts are.
    pub member: Option<String>,
    /// The covariance.
    pub covariance: &'l Covariance,
}

/// `view OF.PART -> TARGET { … }`
#[derive(Clone, Debug, Serialize)]
pub struct View {
    /// The prototype with the whole.
    pub of: String,
    /// The part of its meaning.
    pub part: String,
    /// The prototype of the part.
    pub target: String,
    /// Values of the whole, and of the part.
    pub pairs: Vec<(String, String)>,
}

/// `conversion FROM -> TO = FUNCTION`
#[derive(Clone, Debug, Serialize)]
pub struct Conversion {
    /// The prototype that is converted.
    pub from: String,
    /// The prototype that it becomes.
    pub to: String,
    /// The function.
    pub function: String,
}

impl Prototype {
    /// The type of an interface whose values it gives a meaning: `Module::Name`.
    pub fn interface_type(&self) -> Option<&str> {
        match &self.content {
            Content::Values { language, ty, .. } => (language == "IDSL").then_some(ty),
            Content::Parts(_) => self.composite.as_deref(),
        }
    }
}

/// The path of a member of a part that this member holds.
fn below(member: &str, own: &str) -> String {
    match member {
        "" => own.to_owned(),
        member => format!("{member}.{own}"),
    }
}

impl Library {
    /// Whether a prototype is a part of another one that is about the same type.
    pub fn is_part_of_same(&self, of: &Prototype) -> bool {
        self.prototypes.iter().any(|whole| match &whole.content {
            Content::Parts(parts) => parts
                .iter()
                .any(|part| part.prototype == of.name && part.member.as_deref() == Some("")),
            Content::Values { .. } => false,
        })
    }

    /// These prototypes, each about one element of its sequence. The caller knows the places of the
    /// elements.
    #[must_use]
    pub fn of_elements(&self) -> Self {
        let mut elements = self.clone();
        for prototype in &mut elements.prototypes {
            prototype.sequence = None;
        }
        elements
    }

    /// The prototype with this name.
    pub fn prototype(&self, name: &str) -> Option<&Prototype> {
        self.prototypes.iter().find(|found| found.name == name)
    }

    /// The numbers of a prototype with their places in its type: its own, or those of its parts, in
    /// their order. `None` if a part is a sequence, or if no member holds it.
    pub fn numbers(&self, of: &Prototype) -> Option<Vec<Datum>> {
        let parts = match &of.content {
            Content::Values { data, .. } => return Some(data.clone()),
            Content::Parts(parts) => parts,
        };
        let mut out = Vec::new();
        for part in parts {
            let member = part.member.as_ref()?;
            let inner = self.prototype(&part.prototype);
            let inner = inner.filter(|inner| inner.sequence.is_none())?;
            out.extend(self.numbers(inner)?.into_iter().map(|datum| Datum {
                member: below(member, &datum.member),
                ..datum
            }));
        }
        Some(out)
    }

    /// The covariances of a prototype and of its parts, in their order.
    pub fn covariances<'l>(&'l self, of: &'l Prototype) -> Vec<PlacedCovariance<'l>> {
        let own = of.covariance.iter().map(|covariance| PlacedCovariance {
            part: String::new(),
            member: Some(covariance.member.clone()),
            covariance,
        });
        let mut out: Vec<_> = own.collect();
        let Content::Parts(parts) = &of.content else {
            return out;
        };
        for part in parts {
            let inner = self.prototype(&part.prototype).into_iter();
            let inner = inner.flat_map(|inner| self.covariances(inner));
            out.extend(inner.map(|inner| {
                PlacedCovariance {
                    part: match inner.part.as_str() {
                        "" => part.name.clone(),
                        below => format!("{}.{below}", part.name),
                    },
                    member: part
                        .member
                        .as_ref()
                        .zip(inner.member)
                        .map(|(member, own)| below(member, &own)),
                    ..inner
                }
            }));
        }
        out
    }

    /// The numbers of a prototype, then so many of these of its covariances, with their places in its
    /// type. `None` as for [`Self::numbers`].
    pub fn members(&self, of: &Prototype, covariances: &[(String, usize)]) -> Option<Vec<Datum>> {
        let mut out = self.numbers(of)?;
        let known = self.covariances(of);
        for (part, count) in covariances {
            let own = known.iter().find(|own| own.part == *part)?;
            let member = own.member.as_ref()?;
            out.extend((0..*count).map(|at| Datum {
                symbol: String::new(),
                role: String::new(),
                member: format!("{member}.{at}"),
                unit: None,
                number: own.covariance.number,
                is_opposite: false,
            }));
        }
        Some(out)
    }

    /// The abstract type with this name.
    pub fn algebraic(&self, name: &str) -> Option<&Algebraic> {
        self.algebraics.iter().find(|found| found.name == name)
    }
}
