# Completion of inhabit in bash, written by `inhabit completion bash`.
# inhabit completion bash > ~/.inhabit.bash; in ~/.bashrc: source ~/.inhabit.bash

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

# Runs in the folder `runs`, and those of a run's own folder.
_inhabit_runs() {
  local file
  for file in runs/*/config.json; do
    if [[ -f $file ]]; then printf '%s\n' "${file%/config.json}"; fi
  done
}

_inhabit() {
  local -a reply=() words=() found=()
  local current flag="" command="" taken=0 place=0 word index known marks line
  # bash parts words at "=" and ":"; they are put together again
  for ((index = 1; index <= COMP_CWORD; index++)); do
    word=${COMP_WORDS[index]}
    if [[ ${#words[@]} -gt 0 && ( $word == "=" || $word == ":" || $known == join ) ]]; then
      words[${#words[@]}-1]+=$word
    else
      words+=("$word")
    fi
    if [[ $word == "=" || $word == ":" ]]; then known=join; else known=""; fi
  done
  current=${words[${#words[@]}-1]}
  unset "words[${#words[@]}-1]"
  for word in "${words[@]}"; do
    _inhabit_commands "$command"
    if [[ -z $flag && $place -eq 0 && " ${reply[*]} " == *" $word "* ]]; then
      command+="${command:+ }$word"
      continue
    fi
    if [[ $word == -* ]]; then
      flag=${word%%=*}
      _inhabit_values "$command $flag"
      taken=0
      if [[ $word == *=* || ${reply[0]-0} == 0 ]]; then flag=""; fi
    elif [[ -n $flag ]]; then
      _inhabit_values "$command $flag"
      if [[ ${reply[0]} == 1 ]]; then flag=""; fi
    else
      place=$((place + 1))
    fi
  done
  local before=""
  if [[ $current == --*=* ]]; then
    flag=${current%%=*}
    before=$flag=
    current=${current#*=}
    _inhabit_values "$command $flag"
  elif [[ $current == -* ]]; then
    _inhabit_flags "$command"
    COMPREPLY=($(compgen -W '"${reply[@]}"' -- "$current"))
    return
  elif [[ -n $flag ]]; then
    _inhabit_values "$command $flag"
  else
    _inhabit_commands "$command"
    if [[ $place -eq 0 && ${#reply[@]} -gt 0 ]]; then
      COMPREPLY=($(compgen -W '"${reply[@]}"' -- "$current"))
      return
    fi
    _inhabit_values "$command $((place + 1))"
    if [[ ${#reply[@]} -eq 0 ]]; then _inhabit_values "$command +"; fi
  fi
  COMPREPLY=()
  for word in "${reply[@]:1}"; do
    case $word in
      @files) marks=$(compgen -f -- "$current") ;;
      @runs) marks=$(compgen -W '$(_inhabit_runs)' -- "$current") ;;
      *) marks=$(compgen -W '"$word"' -- "$current") ;;
    esac
    while IFS= read -r line; do
      if [[ -n $line && " ${found[*]} " != *" $line "* ]]; then found+=("$line"); fi
    done <<< "$marks"
  done
  for line in "${found[@]}"; do
    # bash replaces what stands after the last "=" or ":" alone
    if [[ -z $before && $current == *[=:]* ]]; then line=${line#"${current%"${current##*[=:]}"}"}; fi
    if [[ -d $line ]]; then line+=/; fi
    COMPREPLY+=("$line")
  done
  if [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == */ || ${COMPREPLY[0]-} == *= ]]; then
    compopt -o nospace 2>/dev/null
  fi
}

complete -F _inhabit inhabit
