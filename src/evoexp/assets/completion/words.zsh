# The words of a command that are no options: overrides, hashes of stored runs, files.
_evoexp_words() {
  if [[ $PREFIX == *=* ]]; then
    local key=${PREFIX%%=*}
    compset -P '*='
    compadd -- ${(f)"$(evoexp completion options $key 2>/dev/null)"}
  else
    compadd -S '' -- ${=:-GROUPS}
    compadd -- ${EVOEXP_OUTPUTS:-outputs}/runs/*(N:t)
    _files
  fi
}
