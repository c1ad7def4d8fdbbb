-- A session without a screen: it opens a file with two mistakes and the page of one, fixes them, lays the file out, and writes it;
-- then it goes from a component to its interface, lists where that is named, completes a word, and renames.
local function fail(why)
  io.stderr:write(why .. "\n")
  vim.cmd("cquit")
end

local function await(what, is_so)
  if not vim.wait(60000, is_so, 10) then
    fail("no " .. what .. ": " .. vim.inspect(vim.diagnostic.get(0)))
  end
end

local function codes()
  local all = vim.tbl_map(function(found) return found.code end, vim.diagnostic.get(0))
  table.sort(all)
  return table.concat(all, " ")
end

local function run()
  vim.cmd("edit m.idsl")
  await("findings", function() return codes() == "missing-semicolon unknown-type" end)
  vim.cmd("RcgenExplain")
  local page = vim.fn.getline(1)
  if page ~= "# missing-semicolon" and page ~= "# unknown-type" then
    fail("the page of a finding: " .. page)
  end
  vim.cmd("close")
  local client = vim.lsp.get_client_by_id(vim.lsp.get_active_clients()[1].id)
  for _ = 1, 2 do
    local before = codes()
    local parameters = vim.lsp.util.make_range_params()
    parameters.range["end"] = { line = 9, character = 0 }
    parameters.range.start = { line = 0, character = 0 }
    parameters.context = { diagnostics = {} }
    local answer = client.request_sync("textDocument/codeAction", parameters, 60000, 0)
    vim.lsp.util.apply_workspace_edit(answer.result[1].edit, client.offset_encoding)
    await("other findings", function() return codes() ~= before end)
  end
  if codes() ~= "" then
    fail("left: " .. codes())
  end
  local parameters = vim.lsp.util.make_formatting_params()
  local answer = client.request_sync("textDocument/formatting", parameters, 60000, 0)
  vim.lsp.util.apply_text_edits(answer.result, 0, client.offset_encoding)
  vim.cmd("write")

  vim.cmd("edit hand.cdsl")
  vim.fn.search("implements Grip")
  vim.fn.search("Grip")
  vim.lsp.buf.definition()
  await("definition", function() return vim.fn.expand("%:t") == "Grip.idsl" end)
  vim.lsp.buf.references()
  await("references", function() return #vim.fn.getqflist() == 2 end)

  vim.cmd("cclose")
  vim.cmd("edit! hand.cdsl")
  vim.fn.search("implements Grip")
  vim.api.nvim_set_current_line("        requires Gr ")
  vim.api.nvim_win_set_cursor(0, { vim.fn.line("."), #"        requires Gr" })
  local cdsl = vim.lsp.get_client_by_id(vim.lsp.get_active_clients()[1].id)
  local found = cdsl.request_sync("textDocument/completion", vim.lsp.util.make_position_params(), 60000, 0)
  local items = vim.lsp.util.text_document_completion_list_to_complete_items(found.result, "Gr")
  if #items ~= 1 or items[1].word ~= "Grip" then
    fail("completed: " .. vim.inspect(items))
  end

  vim.cmd("edit! Grip.idsl")
  vim.fn.search("press")
  local place = vim.lsp.util.make_position_params()
  place.newName = "squeeze"
  local renamed = cdsl.request_sync("textDocument/rename", place, 60000, 0)
  vim.lsp.util.apply_workspace_edit(renamed.result, cdsl.offset_encoding)
  if vim.fn.search("void squeeze") == 0 then
    fail("renamed: " .. vim.inspect(renamed))
  end
end

local done, why = pcall(run)
if not done then
  fail(tostring(why))
end
vim.cmd("qall!")
