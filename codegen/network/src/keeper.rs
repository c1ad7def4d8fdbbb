//! Components that share the world of any network (`world any`): the clause `World` sets their parameters.

use rc_cdsl::model::World as Clause;
use rc_codegen::{Project, paths};
use rc_configuration::Values;
use rc_configuration::model::Value;
use rc_ddsl::model::{Deployment, Parameter, ParameterValue, World};
use rc_diagnostics::Span;
use rc_syntax::{Literal, LiteralKind, Loader, Name};
use std::path::Path;
use std::rc::Rc;

/// The component that starts and keeps a world.
pub(crate) const KEEPER: &str = "world_keeper";

/// Whether a component with a clause `world` takes part in that of its network, with these parameters. One that can share any
/// world reads its schema from the parameter `schema`: without a file, it leaves the world alone.
pub(crate) fn takes_part(clause: &Clause, values: Option<&Values>) -> bool {
    let schema = values.and_then(|values| values.value("schema"));
    let is_out = matches!(schema, Some(Value::Text(path)) if path.is_empty());
    clause.schema.is_some() || !is_out
}

fn shares_any(project: &Project) -> bool {
    let world = project.component.world.as_ref();
    world.is_some_and(|world| world.schema.is_none())
}

/// Gives each component that shares the world of any network the schema and the files of the world: those of its parameters with
/// these names that its own block does not set.
pub(crate) fn configure(
    deployment: &mut Deployment,
    projects: &[Option<Rc<Project>>],
    loader: &dyn Loader,
) {
    let Some(world) = deployment.world.clone() else {
        return;
    };
    let wanted = parameters(&world, loader);
    for (instance, project) in deployment.instances.iter_mut().zip(projects) {
        let Some(project) = project.as_deref().filter(|project| shares_any(project)) else {
            continue;
        };
        let own: Vec<String> = instance
            .parameters
            .iter()
            .map(|p| p.path.text.clone())
            .collect();
        let known = project.parameters.as_ref();
        let missing = wanted.iter().filter(|p| {
            let name = &p.path.text;
            !own.contains(name)
                && known.is_some_and(|known| known.parameters.iter().any(|own| own.name == *name))
        });
        instance.parameters.extend(missing.cloned());
    }
}

fn parameters(world: &World, loader: &dyn Loader) -> Vec<Parameter> {
    let one = |name: &str, kind: LiteralKind, span: Span| Parameter {
        path: Name::new(name, span),
        value: ParameterValue::One(Literal { kind, span }),
    };
    let file =
        |name: &str, path: &Path, span: Span| one(name, LiteralKind::String(absolute(path)), span);
    let mut all = Vec::new();
    if let Some(schema) = &world.schema {
        let found = loader.find(&world.folder.join("network.ddsl"), &schema.text, "gdsl");
        // A schema that is not found comes with the tools.
        all.push(match found {
            // The loader has joined the folder already.
            Ok(found) => file("schema", &found.path, schema.span),
            Err(_) => one(
                "schema",
                LiteralKind::String(schema.text.clone()),
                schema.span,
            ),
        });
    }
    if let Some(start) = &world.start {
        all.push(file("start", &world.folder.join(&start.text), start.span));
    }
    if let Some((keep, each)) = &world.keep {
        let each = u64::try_from(each.as_nanos()).unwrap_or(u64::MAX);
        all.push(file("keep", &world.folder.join(&keep.text), keep.span));
        all.push(one("each", LiteralKind::Duration(each), keep.span));
    }
    all
}

fn absolute(path: &Path) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    paths::normal(&absolute).display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_codegen::FileLoader;
    use rc_diagnostics::SourceMap;

    /// The loader joins the folder of the network with the schema: once is enough, also where that folder is relative.
    #[test]
    fn a_schema_beside_a_relative_folder_is_found() {
        let span = Span::new(SourceMap::new().add("n.ddsl", ""), 0, 0);
        let world = World {
            name: Name::new("g", span),
            doc: Vec::new(),
            folder: "src/../tests".into(),
            schema: Some(Name::new("../../../components/interfaces/home.gdsl", span)),
            start: None,
            keep: None,
        };
        let all = parameters(&world, &FileLoader::new(&[]));
        let ParameterValue::One(Literal {
            kind: LiteralKind::String(path),
            ..
        }) = &all[0].value
        else {
            panic!("{all:?}")
        };
        assert!(
            Path::new(path).is_absolute() && Path::new(path).is_file(),
            "{path}"
        );
    }
}
