
# No space after "experiment=": its value follows.
_evoexp_complete() {
  _shtab_evoexp
  [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace
  return 0
}
complete -o bashdefault -F _evoexp_complete evoexp
