//! Rules between parameters of components: `require filter.gain < base.limit "unstable";`.
//!
//! For the rules, a network is a component whose groups of parameters are its groups and
//! components. Each component also has its `period` there.

use crate::model::Network;
use rc_configuration::model::{Kind, Parameter, Parameters, Type, Value};
use rc_configuration::{Values, violations_by};
use rc_ddsl::model::Deployment;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::collections::BTreeSet;

/// The name under which rules know the period of a component without a parameter of that name.
const PERIOD: &str = "period";

/// Checks the rules of a network with the values that its components start with.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) {
    let declared = &network.deployment.rules;
    if declared.is_empty() {
        return;
    }
    let tree = Tree {
        network,
        deployment: &network.deployment,
    };
    let mut unknown = BTreeSet::new();
    let parameters = tree.parameters(None, &[], &mut unknown);
    let rules = declared.iter();
    let rules = rules.map(|declared| (declared.scope.as_slice(), &declared.rule));
    let resolved = rc_pdsl::resolve_rules(&parameters, &unknown, rules, found);
    let (rules, places): (Vec<_>, Vec<_>) = resolved
        .into_iter()
        .zip(declared)
        .filter_map(|(rule, declared)| Some((rule?, declared)))
        .unzip();
    let model = Parameters {
        parameters,
        rules,
        ..Parameters::default()
    };
    for (at, explanation) in violations_by(&model, &tree.values(None)) {
        let rule = &places[at].rule;
        let error = Diagnostic::error("rule-broken", rule.condition.span, &rule.message);
        found.push(error.help(explanation));
    }
}

/// The groups and components of a network as groups of parameters.
struct Tree<'n> {
    network: &'n Network,
    deployment: &'n Deployment,
}

impl Tree<'_> {
    /// The parameters of what is in `group`. Adds the components in `unknown` whose parameters could
    /// not be read: their errors have been reported.
    fn parameters(
        &self,
        group: Option<usize>,
        path: &[String],
        unknown: &mut BTreeSet<Vec<String>>,
    ) -> Vec<Parameter> {
        let within = |name: &str| [path, &[name.to_owned()]].concat();
        let mut all = Vec::new();
        for (at, instance) in self.instances(group) {
            let name = &instance.name.text;
            let Some(project) = &self.network.projects[at] else {
                unknown.insert(within(name));
                continue;
            };
            let declared = project.parameters.as_ref();
            let mut parameters = declared.map_or_else(Vec::new, |p| p.parameters.clone());
            if parameters.iter().all(|p| p.name != PERIOD) {
                let ty = Type::Duration;
                parameters.push(Parameter::new(PERIOD, Kind::Scalar { ty, array: None }));
            }
            all.push(Parameter::new(name, Kind::Group(parameters)));
        }
        for (at, group) in self.groups(group) {
            let name = &group.name.text;
            let parameters = self.parameters(Some(at), &within(name), unknown);
            all.push(Parameter::new(name, Kind::Group(parameters)));
        }
        all
    }

    /// The values of what is in `group`. A component with an error has none, and no rule about it is
    /// evaluated.
    fn values(&self, group: Option<usize>) -> Values {
        let mut all = Values::default();
        for (at, instance) in self.instances(group) {
            if let Some(values) = &self.network.parameters[at].values {
                let period = self.network.periods[at].as_nanos();
                let period = Value::Duration(u64::try_from(period).unwrap_or(u64::MAX));
                let values = values.clone().with_value(PERIOD, period);
                all = all.with_group(&instance.name.text, values);
            }
        }
        for (at, group) in self.groups(group) {
            all = all.with_group(&group.name.text, self.values(Some(at)));
        }
        all
    }

    /// The components that the files declare: a proxy has the name of its group.
    fn instances(
        &self,
        group: Option<usize>,
    ) -> impl Iterator<Item = (usize, &rc_ddsl::model::Instance)> {
        let all = self.deployment.instances.iter().enumerate();
        all.filter(move |(_, instance)| {
            let is_made = instance.proxy.is_some() || instance.adaptor.is_some();
            instance.group == group && !is_made
        })
    }

    fn groups(
        &self,
        parent: Option<usize>,
    ) -> impl Iterator<Item = (usize, &rc_ddsl::model::Group)> {
        let all = self.deployment.groups.iter().enumerate();
        all.filter(move |(_, group)| group.parent == parent)
    }
}
