import assert from "node:assert/strict";
import * as fs from "node:fs";
import * as os from "node:os";
import * as path from "node:path";
import { test } from "node:test";
import { componentOf, harmless, pathAt, program, symbolAt } from "../src/places";

test("a program is that of the settings, of PATH, or of cargo", () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "robocomp-"));
  const built = path.join(folder, "target", "debug");
  fs.mkdirSync(built, { recursive: true });
  assert.equal(program("rcgen", "", "", [folder]), undefined);
  fs.writeFileSync(path.join(built, "rcgen"), "", { mode: 0o755 });
  assert.equal(program("rcgen", "", "", [folder]), path.join(built, "rcgen"));
  assert.equal(program("rcgen", "", built, []), path.join(built, "rcgen"));
  assert.equal(program("rcgen", "/opt/rcgen", built, []), "/opt/rcgen");
  fs.rmSync(folder, { recursive: true });
});

test("a part of a picture leads to its component", () => {
  assert.equal(componentOf("voice: speech_server on localhost, over iceoryx2"), "voice");
  assert.equal(componentOf("arm.hand: hand on localhost"), "arm.hand");
  assert.equal(componentOf("speaker.Speech calls voice.Speech: A::B over dds"), "speaker");
  assert.equal(componentOf("The network speech"), undefined);
});

test("a component is found by its path, also inside of a process", () => {
  const leaf = (name: string) => ({ name, children: [] });
  type Tree = { name: string; children: Tree[] };
  const symbols: Tree[] = [
    {
      name: "net",
      children: [
        { name: "eyes", children: [leaf("left")] },
        { name: "arm", children: [leaf("hand")] },
        leaf("hand"),
      ],
    },
  ];
  assert.equal(symbolAt(symbols, "arm.hand"), symbols[0]?.children[1]?.children[0]);
  assert.equal(symbolAt(symbols, "left")?.name, "left");
  assert.equal(symbolAt(symbols, "gone"), undefined);
  assert.equal(pathAt([{ name: "eyes", isPart: false }, { name: "left", isPart: true }]), "left");
});

test("a picture runs nothing", () => {
  assert.equal(harmless("note\n<svg><script>x</script></svg>"), "<svg></svg>");
  assert.equal(harmless("error"), "");
});
