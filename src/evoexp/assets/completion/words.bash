# The words of a command that are no options: overrides, hashes of stored runs, files.
_evoexp_words() {
  local word=$1 key="" before=${COMP_WORDS[COMP_CWORD-1]} folders=() k
  # bash takes "=" for a word of its own
  if [[ $word == "=" ]]; then key=$before word=""
  elif [[ $before == "=" ]]; then key=${COMP_WORDS[COMP_CWORD-2]}; fi
  if [[ -z $key ]]; then
    compgen -W "GROUPS $(command ls "${EVOEXP_OUTPUTS:-outputs}/runs" 2>/dev/null)" -- "$word"
    compgen -f -- "$word"
    return
  fi
  for ((k = 1; k < COMP_CWORD; k++)); do
    [[ ${COMP_WORDS[k]} == --config-dir ]] && folders+=(--config-dir "${COMP_WORDS[k+1]}")
  done
  compgen -W "$(evoexp completion options "$key" "${folders[@]}" 2>/dev/null)" -- "$word"
}
