//! Prints the solvers of a cell as C that becomes a library, and Python that loads it, with arrays of `NumPy`.

use super::{about, arrays, c, limits, names, quoted};
use crate::cell::{Cell, Shape};
use crate::inverse::{Inverse, Question};
use crate::names::type_name;
use std::fmt::Write;

/// The C of a library: that of [`c`], and a function with external linkage for each solver.
pub fn library(cell: &Cell) -> String {
    let name = &cell.name;
    let mut out = c(cell);
    let solvers = out.len();
    let mut function = |of: &str, taken: &[(&str, &str)]| {
        let typed = taken
            .iter()
            .map(|(array, _)| format!("const double *{array}, "));
        let passed = taken.iter().map(|(array, cast)| format!("{cast}{array}, "));
        let _ = writeln!(
            out,
            "\nvoid {name}_call_{of}({}void *result);\nvoid {name}_call_{of}({}void *result)\n{{\n    \
            {name}_{of}({}({name}_{of}_result *)result);\n}}",
            typed.clone().collect::<String>(),
            typed.collect::<String>(),
            passed.collect::<String>()
        );
    };
    for solver in &cell.solvers {
        let taken = arrays(cell, solver);
        let taken: Vec<(&str, &str)> = taken.iter().map(|(array, _)| (*array, "")).collect();
        function(&solver.name, &taken);
    }
    for inverse in &cell.inverses {
        let taken: &[(&str, &str)] = match &inverse.asked {
            Question::Pose(search) if search.seed.is_some() => &[("target", "(double (*)[4])")],
            Question::Pose(_) => &[("target", "(double (*)[4])"), ("last", "")],
            Question::Velocity(_) => &[("positions", ""), ("velocity", "")],
        };
        function(&inverse.name, taken);
    }
    // The solvers have their types already.
    let functions = out.split_off(solvers);
    out + &super::choices::typed(cell, functions, false)
}

fn comment(out: &mut String, lines: &[String]) {
    let text = lines
        .join("\n    ")
        .replace('\\', " ")
        .replace("\"\"\"", "'''");
    let _ = writeln!(out, "    \"\"\"{text}\"\"\"");
}

/// A class for a result: its fields with their comments.
fn class(out: &mut String, of: &str, name: &str, fields: &[(String, String)]) {
    let _ = writeln!(
        out,
        "\n\nclass {of}(NamedTuple):\n    \"\"\"The result of {name}.\"\"\"\n"
    );
    for (doc, field) in fields {
        let _ = writeln!(out, "    # {doc}\n    {field}");
    }
}

/// A function of arrays with these shapes.
fn begin(out: &mut String, of: &str, name: &str, taken: &[(&str, String)], lines: &[String]) {
    let arguments: Vec<&str> = taken.iter().map(|(array, _)| *array).collect();
    let _ = writeln!(out, "\n\ndef {name}({}) -> {of}:", arguments.join(", "));
    comment(out, lines);
    for (array, shape) in taken {
        let _ = writeln!(out, "    {array} = _numbers(\"{array}\", {array}, {shape})");
    }
}

fn passed(taken: &[(&str, String)]) -> String {
    let places = taken.iter().map(|(array, _)| format!("_place({array}), "));
    places.collect()
}

/// All solvers as Python that calls the library `libNAME.so` beside it.
pub fn loader(cell: &Cell) -> String {
    let name = &cell.name;
    let numbers = |all: Vec<f64>| {
        let all = all.into_iter().map(|value| match value {
            f64::INFINITY => "numpy.inf".to_owned(),
            f64::NEG_INFINITY => "-numpy.inf".to_owned(),
            value => format!("{value:?}"),
        });
        all.collect::<Vec<_>>().join(", ")
    };
    let (lower, upper) = limits(cell);
    let slides = cell.choices.length();
    let mut out = format!(
        "# Solvers of {name} for the robot {}. Printed by rcgen.\n\
        import ctypes\nimport pathlib\nfrom typing import NamedTuple\n\nimport numpy\n\n\
        _FILE = pathlib.Path(__file__).with_name(\"lib{name}.so\")\n\
        try:\n    _LIBRARY = ctypes.CDLL(str(_FILE))\nexcept OSError as error:\n    \
        _HOW = \"cc -O2 -ffp-contract=off -shared -fPIC {name}.c -o lib{name}.so -lm\"\n    \
        raise ImportError(f\"{{error}}: build it: {{_HOW}}\") from error\n\n\
        # The joints, in the order of all arrays. Positions are in rad, of joints that slide in {slides}.\n\
        JOINTS = [{}]\n\n# The least and the greatest positions of the joints.\n\
        LOWER = numpy.array([{}], dtype=numpy.float64)\nUPPER = numpy.array([{}], dtype=numpy.float64)\n\n\n\
        def _numbers(name, value, *shape):\n    array = numpy.ascontiguousarray(value, dtype=numpy.float64)\n    \
        if array.shape != shape:\n        raise ValueError(f\"{{name}} has the shape {{array.shape}}, not {{shape}}\")\n    \
        return array\n\n\ndef _place(array):\n    return array.ctypes.data_as(ctypes.c_void_p)\n",
        quoted(&cell.robot.name),
        names(cell),
        numbers(lower),
        numbers(upper),
    );
    for solver in &cell.solvers {
        let of = type_name(&solver.name);
        let fields = solver.outputs.iter();
        let fields = fields.map(|output| {
            (
                output.doc.clone(),
                format!("{}: numpy.ndarray", output.name),
            )
        });
        class(&mut out, &of, &solver.name, &fields.collect::<Vec<_>>());
        let taken = arrays(cell, solver).into_iter();
        let taken: Vec<(&str, String)> = taken
            .map(|(array, size)| (array, size.to_string()))
            .collect();
        begin(&mut out, &of, &solver.name, &taken, &about(solver));
        let size: usize = solver
            .outputs
            .iter()
            .map(|output| output.shape.size())
            .sum();
        let _ = writeln!(
            out,
            "    result = numpy.empty({size}, dtype=numpy.float64)\n    _LIBRARY.{name}_call_{}({}_place(result))",
            solver.name,
            passed(&taken)
        );
        let mut at = 0;
        let parts = solver.outputs.iter().map(|output| {
            let from = at;
            at += output.shape.size();
            match output.shape {
                Shape::Vector(_) => format!("result[{from}:{at}]"),
                Shape::Matrix(rows, columns) if cell.choices.by_columns => {
                    format!("result[{from}:{at}].reshape({columns}, {rows}).T")
                }
                Shape::Matrix(rows, columns) => {
                    format!("result[{from}:{at}].reshape({rows}, {columns})")
                }
            }
        });
        let _ = writeln!(
            out,
            "    return {of}({})",
            parts.collect::<Vec<_>>().join(", ")
        );
    }
    for inverse in &cell.inverses {
        asked(&mut out, cell, inverse);
    }
    if cell.choices.is_single {
        let out = out.replace("numpy.float64", "numpy.float32");
        return out.replace("ctypes.c_double", "ctypes.c_float");
    }
    out
}

fn asked(out: &mut String, cell: &Cell, inverse: &Inverse) {
    let (name, count) = (&cell.name, cell.robot.coordinates.len());
    let own = &inverse.name;
    let of = type_name(own);
    let mut lines = super::inverse::about(inverse);
    lines.push(inverse.question.clone());
    let field = |doc: &str, field: &str| (doc.to_owned(), field.to_owned());
    match &inverse.asked {
        Question::Pose(search) => {
            let fields = [
                field("The positions of all joints.", "positions: numpy.ndarray"),
                field("Whether the frame is there.", "reached: bool"),
                field(
                    "How far it is from there, in the unit of the pose.",
                    "distance: float",
                ),
                field("By which angle it is turned, in rad.", "angle: float"),
                field("How often the motion was computed.", "iterations: int"),
            ];
            class(out, &of, own, &fields);
            let mut taken = vec![("target", "4, 4".to_owned())];
            if search.seed.is_none() {
                taken.push(("last", count.to_string()));
            }
            let _ = writeln!(
                out,
                "\n\nclass _{own}(ctypes.Structure):\n    _fields_ = [\n        (\"positions\", ctypes.c_double * {count}),\n        \
                (\"reached\", ctypes.c_int),\n        (\"distance\", ctypes.c_double),\n        (\"angle\", ctypes.c_double),\n        \
                (\"iterations\", ctypes.c_int),\n    ]"
            );
            begin(out, &of, own, &taken, &lines);
            if cell.choices.by_columns {
                out.push_str("    target = numpy.ascontiguousarray(target.T)\n");
            }
            let _ = writeln!(
                out,
                "    found = _{own}()\n    _LIBRARY.{name}_call_{own}({}ctypes.byref(found))\n    \
                positions = numpy.array(found.positions)\n    \
                return {of}(positions, bool(found.reached), found.distance, found.angle, found.iterations)",
                passed(&taken)
            );
        }
        Question::Velocity(_) => {
            let fields = [
                field("The velocities of all joints.", "velocities: numpy.ndarray"),
                field(
                    "The velocity of the frame with these.",
                    "achieved: numpy.ndarray",
                ),
            ];
            class(out, &of, own, &fields);
            let taken = [
                ("positions", count.to_string()),
                ("velocity", "6".to_owned()),
            ];
            begin(out, &of, own, &taken, &lines);
            let _ = writeln!(
                out,
                "    result = numpy.empty({}, dtype=numpy.float64)\n    _LIBRARY.{name}_call_{own}({}_place(result))\n    \
                return {of}(result[:{count}], result[{count}:])",
                count + 6,
                passed(&taken)
            );
        }
    }
}
