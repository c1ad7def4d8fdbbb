// Uses VS Code in a browser as a person does. Arguments: Chromium, the port of the server, the folder that is opened.

import assert from "node:assert/strict";
import * as fs from "node:fs";
import * as path from "node:path";
import { chromium } from "playwright-core";

const [program, port, folder] = process.argv.slice(2);
const browser = await chromium.launch({ executablePath: program, args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1400, height: 900 } });
page.setDefaultTimeout(120_000);
const file = path.join(folder, "net.ddsl");
const text = () => fs.readFileSync(file, "utf8");

/** Waits until a file has a text. */
async function saved(expected) {
  for (let tries = 0; tries < 1200 && text() !== expected; tries++) {
    await page.waitForTimeout(50);
  }
  assert.equal(text(), expected);
}

async function opens(name) {
  await page.locator(".explorer-folders-view .monaco-list-row", { hasText: name }).dblclick();
  await page.locator(`.tab.active[data-resource-name="${name}"]`).waitFor();
}

async function command(title) {
  await page.keyboard.press("F1");
  await page.locator(".quick-input-box input").fill(`>${title}`);
  await page.locator(".quick-input-list .monaco-list-row", { hasText: title }).first().click();
}

try {
  await page.goto(`http://127.0.0.1:${port}/?folder=${folder}`);
  await page.getByRole("button", { name: "Yes, I trust" }).click();
  await opens("net.ddsl");

  // A wrong slot: the finding shows, and its fix is clicked.
  const before = text();
  await page.locator(".editor-instance .view-lines").first().click();
  await page.keyboard.press("Control+Home");
  for (let line = 0; line < 4; line++) {
    await page.keyboard.press("ArrowDown");
  }
  await page.keyboard.type("    bind b.Girp -> a.Grip;\n");
  const finding = page.locator(".squiggly-error").first();
  await finding.waitFor();
  // On a busy machine, findings of the half-typed line are there first.
  const widget = page.locator(".marker-widget", { hasText: "did you mean `Grip`?" });
  for (let tries = 0; tries < 60 && !(await widget.isVisible()); tries++) {
    await page.keyboard.press("Escape");
    await page.keyboard.press("F8");
    await widget.waitFor({ timeout: 2_000 }).catch(() => {});
  }
  await widget.waitFor();
  await page.locator(".marker-widget a.code-link").click({ modifiers: ["Control"] });
  await page.locator('.tab.active[data-resource-name="unknown-slot.md"]').waitFor();
  await page.locator(".view-lines", { hasText: "# unknown-slot" }).waitFor();
  console.log("The code of a finding leads to its page.");
  await page.locator('.tab[data-resource-name="net.ddsl"]').click();
  await page.locator('.tab.active[data-resource-name="net.ddsl"]').waitFor();
  await page.keyboard.press("Escape");
  await page.locator('.lightBulbWidget:visible, [class*="gutter-lightbulb"]:visible').first().click();
  await page.locator(".action-widget", { hasText: "Write `Grip`" }).waitFor();
  // A transparent part takes the mouse until it moves.
  const fix = page.locator(".action-widget .monaco-list-row", { hasText: "Write `Grip`" });
  const box = await fix.boundingBox();
  assert(box);
  await page.mouse.move(box.x + 20, box.y + 2);
  await page.mouse.click(box.x + 25, box.y + box.height / 2);
  await finding.waitFor({ state: "detached" });
  await page.keyboard.press("Control+S");
  await saved(before.replace("\n};", "\n    bind b.Grip -> a.Grip;\n};"));
  console.log("A wrong slot is found, and its fix is clicked.");

  // The picture: a click on a component goes to its line.
  await command("RoboComp: Show Network as a Picture");
  const picture = page.frameLocator("iframe.webview").frameLocator("iframe");
  await picture.locator("#picture svg").waitFor();
  const component = picture.locator("g:has(> title)").filter({ hasText: "asker" }).first();
  await component.click();
  await page.getByText("Ln 4, Col").waitFor();
  await picture.locator("g.here", { hasText: "asker" }).first().waitFor();
  console.log("The picture leads to the line of a component, and follows the cursor.");

  // The running network: its states are in the picture, and a button ends a component, another one starts it.
  await opens("live.ddsl");
  const viewer = picture.locator("g:has(> title)").filter({ hasText: "pose_monitor" }).first();
  await viewer.waitFor();
  await picture.locator("#live").click();
  await viewer.filter({ hasText: "running" }).waitFor();
  await viewer.click();
  await picture.locator("#stop:enabled").click();
  await viewer.filter({ hasText: "stopped" }).waitFor();
  await picture.locator("g:has(> title)", { hasText: "simulator" }).filter({ hasText: "running" }).first().waitFor();
  await picture.locator("#start:enabled").click();
  await viewer.filter({ hasText: "running" }).waitFor();
  console.log("Buttons of the picture stop and start a component of a running network.");
} catch (error) {
  const shot = path.join(import.meta.dirname, "window.png");
  await page.screenshot({ path: shot });
  console.log(`A picture of the window: ${shot}`);
  throw error;
} finally {
  await browser.close();
}
