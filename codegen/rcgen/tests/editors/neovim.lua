-- Neovim's client of rcgen, for init.lua; Neovim 0.7 or newer.
local rcgen
vim.api.nvim_create_autocmd({ "BufReadPost", "BufNewFile" }, {
  pattern = { "*.idsl", "*.cdsl", "*.pdsl", "*.smdsl", "*.scxml", "*.ddsl", "*.gdsl", "*.graph", "*.dproto", "*.kdsl", "*.urdf", "*.xml", "*/etc/*.toml", "*/src/*.rs", "*/src/*.py" },
  callback = function()
    rcgen = rcgen or vim.lsp.start_client({
      name = "rcgen",
      cmd = { "rcgen", "lsp" },
      root_dir = vim.fn.getcwd(),
    })
    vim.lsp.buf_attach_client(0, rcgen)
  end,
})
