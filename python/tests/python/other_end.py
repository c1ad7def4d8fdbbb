"""The component at the other end of the conformance tests: it answers calls, repeats samples, and
makes calls when it is asked to. `other_end.py ARGUMENTS`."""

import os
import sys
from datetime import timedelta

import robocomp
from build import Fixture, generated_hashes, generated_module

MODULE = generated_module("components/interfaces/generated/src/rc_interop.rs")
FIXTURE = Fixture("other_end", [MODULE], os.environ["TEST_MIDDLEWARE"])
FIXTURE.hashes = generated_hashes("middleware/interop/generated/src/description.rs")
FIXTURE.slot("Interop", "implements", "RcInterop::Interop")
FIXTURE.slot("Reports", "subscribesTo", "RcInterop::Reports")
FIXTURE.slot("Echoes", "publishes", "RcInterop::Echoes")
FIXTURE.slot("Oracle", "requires", "RcInterop::Oracle")
Nonsense = FIXTURE.types["RcInterop::Nonsense"]


class SpecificWorker(FIXTURE.worker):
    def initialize(self, ctx):
        self.noted_texts = []

    def shift(self, ctx, report, by):
        if not report.marks:
            raise Nonsense(f"`{report.text}` has no marks", -7)
        if report.text == "fails":
            raise ValueError("it fails")
        if report.text == "wrong":
            return len(report.marks), "no report"
        for mark in report.marks:
            mark.at.x += by
            mark.at.y += by
        return len(report.marks), report

    def note(self, ctx, text):
        self.noted_texts.append(text)

    def noted(self, ctx):
        return self.noted_texts

    def consult(self, ctx, question, limit):
        ctx.oracle.timeout = timedelta(milliseconds=limit)
        try:
            place, number = ctx.oracle.ask(question)
        except Nonsense as error:
            return f"nonsense {error.code}: {error.what}"
        except robocomp.Refused as error:
            return f"refused: {error}"
        except robocomp.CallError as error:
            return type(error).__name__
        ctx.oracle.tell(question)
        return f"{number} at {place.x} {place.y}"

    def add(self, ctx, a, b):
        return a + b

    def report(self, ctx, report):
        ctx.echoes.echo(report)


sys.exit(robocomp.main(FIXTURE.component(SpecificWorker), SpecificWorker, sys.argv[1:]))
