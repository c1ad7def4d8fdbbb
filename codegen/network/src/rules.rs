//! Rules between parameters of components: `require filter.gain < base.limit "unstable";`.
//!
//! For the rules, a network is a component whose groups of parameters are its groups and
//! components. Each component also has its `period` there.

use crate::model::Network;
use rc_configuration::condition::Reference;
use rc_configuration::model::{Kind, Parameter, Parameters, Rule, Type, Value};
use rc_configuration::{LiveParameters, Values, violations_by};
use rc_ddsl::model::Deployment;
use rc_diagnostics::{Diagnostic, Diagnostics};
use serde_json::{Map, Value as Json};
use std::collections::{BTreeMap, BTreeSet};

/// The name under which rules know the period of a component without a parameter of that name.
const PERIOD: &str = "period";

/// Checks the rules of a network with the values that its components start with.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) {
    let (rules, places) = NetworkRules::resolved(network, found);
    for (at, explanation) in rules.violations(&rules.members) {
        let rule = &network.deployment.rules[places[at]].rule;
        let error = Diagnostic::error("rule-broken", rule.condition.span, &rule.message);
        found.push(error.help(explanation));
    }
}

/// The rules between parameters of components, and the values that they are about.
#[derive(Clone, Debug, Default)]
pub struct NetworkRules {
    /// A network as one component: each component is a group of parameters.
    model: Parameters,
    /// The components by their names, with dots.
    members: Members,
}

type Members = BTreeMap<String, Member>;

/// The parameters of one component.
#[derive(Clone, Debug)]
struct Member {
    model: Parameters,
    values: Values,
    period: Value,
}

/// Changes that no rule refuses: the new values of the changed components.
#[derive(Clone, Debug)]
pub struct RuledChanges(Members);

impl NetworkRules {
    /// The rules of a network without errors, with the values that its components start with.
    pub fn of(network: &Network) -> Self {
        Self::resolved(network, &mut Diagnostics::new()).0
    }

    /// The rules, and where each is declared.
    fn resolved(network: &Network, found: &mut Diagnostics) -> (Self, Vec<usize>) {
        let declared = &network.deployment.rules;
        if declared.is_empty() {
            return <(Self, Vec<usize>)>::default();
        }
        let mut tree = Tree {
            network,
            deployment: &network.deployment,
            unknown: BTreeSet::new(),
            members: Members::new(),
        };
        let parameters = tree.parameters(None, &[]);
        let rules = declared.iter();
        let rules = rules.map(|declared| (declared.scope.as_slice(), &declared.rule));
        let resolved = rc_pdsl::resolve_rules(&parameters, &tree.unknown, rules, found);
        let resolved = resolved.into_iter().enumerate();
        let (rules, places) = resolved.filter_map(|(at, rule)| Some((rule?, at))).unzip();
        let model = Parameters {
            parameters,
            rules,
            ..Parameters::default()
        };
        let members = tree.members;
        (Self { model, members }, places)
    }

    /// The parameters of a component that rules read, by the beginnings of their paths.
    pub fn ruled(&self, component: &str) -> Vec<String> {
        let inside = format!("{component}.");
        let read = self.model.rules.iter().flat_map(paths);
        let read = read.filter_map(|path| Some(path.strip_prefix(&inside)?.to_owned()));
        let read: BTreeSet<String> = read.collect();
        read.into_iter().collect()
    }

    /// Checks changes of components together: paths and values of each. The error lists invalid
    /// changes, or the rules that would be broken, with the values.
    pub fn check(
        &self,
        changes: &BTreeMap<String, Map<String, Json>>,
    ) -> Result<RuledChanges, String> {
        let mut changed = Members::new();
        for (name, changes) in changes {
            let Some(member) = self.members.get(name) else {
                continue;
            };
            let live = LiveParameters::new(member.model.clone(), &member.values);
            let changes = changes.iter().map(|(path, value)| (path.as_str(), value));
            // The places are in no file.
            let accepted = live.check(changes).map_err(|found| {
                let found: Vec<String> = found.iter().map(text).collect();
                format!("{name}: {}", found.join("; "))
            })?;
            let values = accepted.values();
            let member = member.clone();
            changed.insert(name.clone(), Member { values, ..member });
        }
        let mut all = self.members.clone();
        all.extend(changed.clone());
        let broken = self.broken(&all);
        if broken.is_empty() {
            Ok(RuledChanges(changed))
        } else {
            Err(broken.join("; "))
        }
    }

    /// The changes are in force.
    pub fn apply(&mut self, changes: RuledChanges) {
        self.members.extend(changes.0);
    }

    /// A component runs with its configuration again, in place of `values`. Returns the rules that
    /// are broken now.
    pub fn reset(&mut self, component: &str, start: &Self) -> Vec<String> {
        if let Some(member) = start.members.get(component) {
            self.members.insert(component.to_owned(), member.clone());
        }
        self.broken(&self.members)
    }

    fn broken(&self, members: &Members) -> Vec<String> {
        let violations = self.violations(members).into_iter();
        let text = |(at, explanation): (usize, String)| {
            format!("{} ({explanation})", self.model.rules[at].message)
        };
        violations.map(text).collect()
    }

    /// The rules that values break, each with an explanation.
    fn violations(&self, members: &Members) -> Vec<(usize, String)> {
        let values = members.iter().map(|(name, member)| {
            let path: Vec<&str> = name.split('.').collect();
            let values = member.values.clone();
            // A parameter of that name takes precedence.
            (path, values.with_value(PERIOD, member.period.clone()))
        });
        violations_by(&self.model, &in_groups(values.collect()))
    }
}

/// A finding for people.
fn text(finding: &Diagnostic) -> String {
    match &finding.help {
        Some(help) => format!("{} ({help})", finding.message),
        None => finding.message.clone(),
    }
}

/// The whole paths that a rule reads.
fn paths(rule: &Rule) -> impl Iterator<Item = String> {
    let whole = |reference: &Reference| {
        let block = &rule.scope[..reference.level.min(rule.scope.len())];
        [block, &reference.path].concat().join(".")
    };
    rule.condition
        .references()
        .map(move |(_, reference)| whole(reference))
}

/// Values of components at their paths, as values of nested groups.
fn in_groups(members: Vec<(Vec<&str>, Values)>) -> Values {
    let mut all = Values::default();
    let mut groups: BTreeMap<&str, Vec<(Vec<&str>, Values)>> = BTreeMap::new();
    for (path, values) in members {
        match path.as_slice() {
            [] => {}
            [name] => all = all.with_group(name, values),
            [group, rest @ ..] => {
                let inside = groups.entry(group).or_default();
                inside.push((rest.to_vec(), values));
            }
        }
    }
    for (name, members) in groups {
        all = all.with_group(name, in_groups(members));
    }
    all
}

/// The groups and components of a network as groups of parameters.
struct Tree<'n> {
    network: &'n Network,
    deployment: &'n Deployment,
    /// The components whose parameters could not be read: their errors have been reported.
    unknown: BTreeSet<Vec<String>>,
    /// The members that have values. No rule about another one is evaluated.
    members: Members,
}

impl<'n> Tree<'n> {
    /// The parameters of the contents of `group`. Notes the components in it.
    fn parameters(&mut self, group: Option<usize>, path: &[String]) -> Vec<Parameter> {
        let within = |name: &str| [path, &[name.to_owned()]].concat();
        let network = self.network;
        let mut all = Vec::new();
        for (at, instance) in self.instances(group) {
            let name = &instance.name.text;
            let Some(project) = &network.projects[at] else {
                self.unknown.insert(within(name));
                continue;
            };
            let model = project.parameters.clone().unwrap_or_default();
            let mut parameters = model.parameters.clone();
            if parameters.iter().all(|p| p.name != PERIOD) {
                let ty = Type::Duration;
                parameters.push(Parameter::new(PERIOD, Kind::Scalar { ty, array: None }));
            }
            if let Some(values) = &network.parameters[at].values {
                let period = network.periods[at].as_nanos();
                let period = Value::Duration(u64::try_from(period).unwrap_or(u64::MAX));
                let member = Member {
                    // The component itself checks its own rules. Some of their values may have changed
                    // without the supervisor.
                    model: Parameters {
                        rules: Vec::new(),
                        ..model
                    },
                    values: values.clone(),
                    period,
                };
                self.members.insert(within(name).join("."), member);
            }
            all.push(Parameter::new(name, Kind::Group(parameters)));
        }
        for (at, group) in self.groups(group) {
            let name = &group.name.text;
            let parameters = self.parameters(Some(at), &within(name));
            all.push(Parameter::new(name, Kind::Group(parameters)));
        }
        all
    }

    /// The components that the files declare: a proxy has the name of its group.
    fn instances(
        &self,
        group: Option<usize>,
    ) -> impl Iterator<Item = (usize, &'n rc_ddsl::model::Instance)> + use<'n> {
        let all = self.deployment.instances.iter().enumerate();
        all.filter(move |(_, instance)| {
            let is_made = instance.proxy.is_some() || instance.adaptor.is_some();
            instance.group == group && !is_made
        })
    }

    fn groups(
        &self,
        parent: Option<usize>,
    ) -> impl Iterator<Item = (usize, &'n rc_ddsl::model::Group)> + use<'n> {
        let all = self.deployment.groups.iter().enumerate();
        all.filter(move |(_, group)| group.parent == parent)
    }
}
