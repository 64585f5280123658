# SPDX-License-Identifier: GPL-3.0-or-later
# Completion for brainshift and brainshiftd: the program's own --help says what there is.
_brainshift() {
  local words pattern='--[a-z][a-z-]*' word=${COMP_WORDS[COMP_CWORD]} command=("${COMP_WORDS[0]}") i
  for ((i = 1; i < COMP_CWORD; i++)); do
    [[ ${COMP_WORDS[i]} == [a-z]* && ${COMP_WORDS[i]} != */* && ${COMP_WORDS[i]} != *.* ]] || break
    command+=("${COMP_WORDS[i]}")
  done
  if [[ $word == -* ]]; then
    words=$("${command[@]}" --help 2>/dev/null | grep -oE -- "$pattern" | sort -u)
  elif ((COMP_CWORD == ${#command[@]})); then
    words=$("${command[@]}" --help 2>/dev/null | sed -n '/^Subcommands:/,/^[^ S]/s/^  \([a-z]\+\) .*/\1/p')
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -o default -F _brainshift brainshift brainshiftd
