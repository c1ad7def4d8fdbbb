//! `rcgen`: from description files to a component.
//!
//! `command_line::TOOL` lists the exit codes.

mod checks;
mod clean;
mod command_line;
mod component;
mod configuration;
mod datasheet;
mod export;
mod generation;
mod graph;
mod graph_views;
mod graphs;
mod index;
mod innermodel;
mod install;
mod kinematics;
mod prototypes;
mod reports;
mod robocomp;
mod start;
mod venv;

use command_line::{Cli, Command, TOOL, Target};
use export::Request;
use rc_codegen::Files;
use rc_codegen::files::Owner;
use rc_command_line::Common;
use rcgen::fix::FixSelection;
use reports::{Failure, print, print_line, system, tell};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn import(
    files: &[PathBuf],
    out: &Path,
    schema: Option<&Path>,
    common: &command_line::Common,
) -> Result<(), Failure> {
    let is_graph = |path: &Path| path.extension().is_some_and(|ending| ending == "graph");
    if let Some(schema) = schema {
        return match files {
            [file] if is_graph(file) && is_graph(out) => graphs::migrate(file, out, schema, common),
            _ => {
                let message = "`--schema` is for one .graph file, and --out is another one";
                Err(Failure::Usage(message.to_owned()))
            }
        };
    }
    match files {
        [word, folder] if word == Path::new("robocomp") => robocomp::import(folder, out, common),
        _ if is_graph(out) && files.iter().all(|file| is_graph(file)) => {
            graphs::join(files, out, common)
        }
        [file] if is_graph(out) => graphs::import(file, out, common),
        [file] if is_graph(file) || file.extension().is_some_and(|ending| ending == "json") => {
            graphs::scene(file, out, common)
        }
        [file] => innermodel::import(file, out, common.format),
        _ => {
            let message =
                "several files are joined only if all of them, and --out, are .graph files";
            Err(Failure::Usage(message.to_owned()))
        }
    }
}

fn export(request: &Request<'_>) -> Result<(), Failure> {
    match request.target {
        Target::Dsr | Target::Graphml | Target::Turtle | Target::Graph => graphs::export(request),
        _ if request.domain.is_some() => {
            let message =
                "`--domain` takes a part of a graph; write it to dsr, graphml, turtle or graph";
            Err(Failure::Usage(message.to_owned()))
        }
        Target::Urdf | Target::Gltf => innermodel::export(request),
        Target::Code(language) => kinematics::export(request, language),
        Target::Dds | Target::Ros2 => export::export(request),
    }
}

fn main() -> ExitCode {
    let cli: Cli = TOOL.parse();
    let outcome = match cli.command {
        Some(Command::Init {
            dir,
            framework,
            shared_target,
        }) => start::init(&dir, &framework, shared_target),
        Some(Command::New(args)) => start::new(args),
        Some(Command::Generate(args)) => generation::generate(args),
        Some(Command::Clean { paths, dry_run }) => clean::clean(paths, dry_run),
        Some(Command::Check {
            files,
            robocomp,
            fix,
            common,
        }) => generation::here_or(files).and_then(|files| {
            let fix = fix.then_some(FixSelection::Certain);
            checks::check(&files, robocomp, fix, &common)
        }),
        Some(Command::Fix {
            files,
            likely,
            common,
        }) => {
            let which = if likely {
                FixSelection::Likely
            } else {
                FixSelection::Certain
            };
            generation::here_or(files)
                .and_then(|files| checks::check(&files, false, Some(which), &common))
        }
        Some(Command::Lsp { include }) => match rcgen::server::run(&include) {
            Ok(true) => Ok(()),
            // The protocol wants this code.
            Ok(false) => Err(Failure::Input),
            Err(error) => Err(system(error)),
        },
        Some(Command::Fmt {
            files,
            check,
            format,
        }) => generation::here_or(files).and_then(|files| checks::fmt(&files, check, format)),
        Some(Command::Config {
            update: _,
            file,
            common,
            dry_run,
            check,
        }) => configuration::update(&file, &common, dry_run, check),
        Some(Command::Explain { code }) => checks::explain(code.as_deref()),
        Some(Command::Export {
            file,
            to,
            out,
            domain,
            common,
            dry_run,
        }) => export(&Request {
            target: to,
            file: &file,
            out: &out,
            domain: domain.as_deref(),
            common: &common,
            dry_run,
        }),
        Some(Command::Import {
            files,
            out,
            schema,
            common,
        }) => import(&files, &out, schema.as_deref(), &common),
        Some(Command::Query {
            file,
            query,
            parameters,
            reflect,
            steps,
            rows,
            common,
        }) => graphs::query(&graphs::QueryRequest {
            file: &file,
            text: query.as_deref(),
            parameters: &parameters,
            is_reflected: reflect,
            budget: graph_query::Budget::new(steps, rows),
            common: &common,
        }),
        Some(Command::Stubs { file, common, out }) => component::print_stubs(&file, &common, out),
        Some(Command::Venv {
            file,
            common,
            python,
            dev,
            wheel,
        }) => venv::make(&file, &common, python.as_deref(), dev, wheel.as_deref()),
        Some(Command::Install {
            files,
            common,
            prefix,
            profile,
            replace,
            dry_run,
        }) => install::install(&install::Request {
            files: &files,
            common: &common,
            prefix: prefix.unwrap_or_else(rc_codegen::installed::prefix),
            profile,
            replace,
            dry_run,
        }),
        Some(Command::Graph {
            file,
            common,
            to,
            output,
        }) => graph::graph(&file, &common, to, output.as_deref()),
        Some(Command::Index {
            paths,
            include,
            output,
            since,
        }) => index::index(&paths, &include, output.as_deref(), since.as_deref()),
        Some(Command::Datasheet {
            file,
            common,
            to,
            output,
        }) => datasheet::print_sheet(&file, &common, to, output.as_deref()),
        Some(Command::Convert {
            from: Some(from),
            to: Some(to),
            files,
            common,
            language,
            list: _,
        }) => prototypes::convert(&from, &to, &files, &common, language),
        Some(Command::Convert { .. }) => {
            print(&rc_prototypes::listing());
            Ok(())
        }
        Some(Command::View { file, common, .. })
            if file.extension().is_some_and(|ending| ending == "dproto") =>
        {
            prototypes::view(&file, &common)
        }
        Some(Command::View { file, common, .. })
            if file
                .extension()
                .is_some_and(|ending| ending == "kdsl" || ending == "ilk") =>
        {
            kinematics::view(&file, &common)
        }
        Some(Command::View { file, common, .. }) if graph_views::is_graph(&file) => {
            graph_views::view(&file, &common)
        }
        Some(Command::View {
            file,
            common,
            middleware,
        }) => component::print_view(&file, &common, middleware),
        Some(Command::Common(Common::Completions { shell })) => {
            print(&TOOL.completion_script(shell));
            Ok(())
        }
        Some(Command::Common(Common::Man { dir })) => man_pages(&dir),
        None => generation::run(&cli.generate),
    };
    let (code, message) = match outcome {
        Ok(()) => (0, None),
        Err(Failure::Input) => (1, None),
        Err(Failure::Usage(message)) => (2, Some(message)),
        Err(Failure::System(message)) => (3, Some(message)),
    };
    let (code, message) = rc_diagnostics::print::exit_code(code, message, 3);
    if let Some(message) = message {
        tell(format_args!("rcgen: error: {message}"));
    }
    ExitCode::from(code)
}

fn man_pages(dir: &Path) -> Result<(), Failure> {
    let mut files = Files::default();
    for page in TOOL.man_pages::<Cli>() {
        files.add(page.file, Owner::Exported, page.text);
    }
    for step in files.write(dir).map_err(system)? {
        let path = dir.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
    }
    Ok(())
}
