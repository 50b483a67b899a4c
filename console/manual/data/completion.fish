# Completion of inhabit in fish, written by `inhabit completion fish`.
# inhabit completion fish > ~/.config/fish/completions/inhabit.fish

function __inhabit_commands
    switch "$argv[1]"
#COMMANDS#
    end
end

function __inhabit_flags
    switch "$argv[1]"
#FLAGS#
    end
end

function __inhabit_values
    switch "$argv[1]"
#VALUES#
    end
end

function __inhabit
    set -l tokens (commandline -opc)
    set -e tokens[1]
    set -l current (commandline -ct)
    set -l command ""
    set -l flag ""
    set -l place 0
    set -l row
    for word in $tokens
        if test -z "$flag" -a $place -eq 0
            if contains -- $word (__inhabit_commands "$command" | string replace -r '\t.*' '')
                set command (string trim -- "$command $word")
                continue
            end
        end
        if string match -q -- '-*' $word
            set flag (string replace -r '=.*' '' -- $word)
            set row (__inhabit_values "$command $flag")
            if string match -q -- '*=*' $word; or test (count $row) -eq 0; or test $row[1] = 0
                set flag ""
            end
        else if test -n "$flag"
            set row (__inhabit_values "$command $flag")
            if test $row[1] = 1
                set flag ""
            end
        else
            set place (math $place + 1)
        end
    end
    set -l before ""
    if string match -qr -- '^--.*=' $current
        set -l name (string replace -r '=.*' '' -- $current)
        set before "$name="
        set row (__inhabit_values "$command $name")
    else if string match -q -- '-*' $current
        __inhabit_flags "$command"
        return
    else if test -n "$flag"
        set row (__inhabit_values "$command $flag")
    else
        if test $place -eq 0
            set row (__inhabit_commands "$command")
            if test (count $row) -gt 0
                printf '%s\n' $row
                return
            end
        end
        set row (__inhabit_values "$command "(math $place + 1))
        if test (count $row) -eq 0
            set row (__inhabit_values "$command +")
        end
    end
    for word in $row[2..-1]
        switch $word
            case @files
                __fish_complete_path (string replace -- "$before" '' $current)
            case @runs
                for file in runs/*/config.json
                    printf '%s\trun\n' (string replace /config.json '' -- $file)
                end
            case '*'
                printf '%s%s\n' $before $word
        end
    end
end

complete --command inhabit --no-files --arguments '(__inhabit)'
