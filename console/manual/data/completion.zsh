#compdef inhabit
# Completion of inhabit in zsh, written by `inhabit completion zsh`.
# inhabit completion zsh > ~/.inhabit.zsh; in ~/.zshrc, after compinit: source ~/.inhabit.zsh

_inhabit_commands() {
  case $1 in
#COMMANDS#
    *) reply=() ;;
  esac
}

_inhabit_flags() {
  case $1 in
#FLAGS#
    *) reply=() ;;
  esac
}

_inhabit_values() {
  case $1 in
#VALUES#
    *) reply=() ;;
  esac
}

# Offer the words of `reply`, each with its meaning behind a tab.
_inhabit_offer() {
  local -a names shown
  local row
  for row in "${reply[@]}"; do
    names+=("${row%%$'\t'*}")
    shown+=("${row%%$'\t'*}  ${row#*$'\t'}")
  done
  compadd -l -d shown -a names
}

_inhabit() {
  local -a reply runs
  local current=${words[CURRENT]} flag="" command="" word known
  local -i place=0 index
  for ((index = 2; index < CURRENT; index++)); do
    word=${words[index]}
    _inhabit_commands "$command"
    known=" ${(j: :)reply[@]%%$'\t'*} "
    if [[ -z $flag && $place -eq 0 && $known == *" $word "* ]]; then
      command+="${command:+ }$word"
      continue
    fi
    if [[ $word == -* ]]; then
      flag=${word%%=*}
      _inhabit_values "$command $flag"
      if [[ $word == *=* || ${reply[1]:-0} == 0 ]]; then flag=""; fi
    elif [[ -n $flag ]]; then
      _inhabit_values "$command $flag"
      if [[ ${reply[1]} == 1 ]]; then flag=""; fi
    else
      place+=1
    fi
  done
  if [[ $current == --*=* ]]; then
    _inhabit_values "$command ${current%%=*}"
    compset -P '*='
  elif [[ $current == -* ]]; then
    _inhabit_flags "$command"
    _inhabit_offer
    return
  elif [[ -n $flag ]]; then
    _inhabit_values "$command $flag"
  else
    _inhabit_commands "$command"
    if [[ $place -eq 0 && ${#reply} -gt 0 ]]; then
      _inhabit_offer
      return
    fi
    _inhabit_values "$command $((place + 1))"
    if [[ ${#reply} -eq 0 ]]; then _inhabit_values "$command +"; fi
  fi
  for word in "${(@)reply[2,-1]}"; do
    case $word in
      @files) _files ;;
      @runs)
        runs=(runs/*/config.json(N:h))
        compadd -a runs
        ;;
      *=) compadd -S '' -- "$word" ;;
      *) compadd -- "$word" ;;
    esac
  done
}

compdef _inhabit inhabit
