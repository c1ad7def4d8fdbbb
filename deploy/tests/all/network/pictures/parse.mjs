// Reads the files that it is given as Mermaid does.
import fs from 'node:fs';
import { JSDOM } from 'jsdom';

const page = new JSDOM('<!DOCTYPE html><body></body>');
globalThis.window = page.window;
globalThis.document = page.window.document;
const { default: mermaid } = await import('mermaid');
for (const file of process.argv.slice(2)) {
  await mermaid.parse(fs.readFileSync(file, 'utf8'));
}
