-- Neovim's client of rcgen, for init.lua; Neovim 0.7 or newer.
local rcgen
local offered = vim.lsp.protocol.make_client_capabilities()
offered.textDocument.publishDiagnostics.codeDescriptionSupport = true
vim.api.nvim_create_autocmd({ "BufReadPost", "BufNewFile" }, {
  pattern = { "*.idsl", "*.cdsl", "*.pdsl", "*.smdsl", "*.scxml", "*.ddsl", "*.gdsl", "*.graph", "*.dproto", "*.kdsl", "*.ilk", "*.urdf", "*.xml", "*/etc/*.toml", "*/src/*.rs", "*/src/*.py" },
  callback = function()
    rcgen = rcgen or vim.lsp.start_client({
      name = "rcgen",
      cmd = { "rcgen", "lsp" },
      root_dir = vim.fn.getcwd(),
      capabilities = offered,
    })
    vim.lsp.buf_attach_client(0, rcgen)
  end,
})
-- The page of the finding in the line of the cursor.
vim.api.nvim_create_user_command("RcgenExplain", function()
  for _, found in ipairs(vim.diagnostic.get(0, { lnum = vim.fn.line(".") - 1 })) do
    local page = vim.tbl_get(found, "user_data", "lsp", "codeDescription", "href")
    if page then
      vim.cmd("split " .. vim.fn.fnameescape(vim.uri_to_fname(page)))
      return
    end
  end
end, {})
