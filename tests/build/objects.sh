# shellcheck shell=bash
# What must not be in the objects of the rooms that decide a pixel; sourced.

# objects FOLDER_OR_OBJECT...: of a build folder, those of these rooms; one a line.
objects() {
    local at
    for at in "$@"; do
        if [ -d "$at" ]; then
            find "$at"/obj/common/{base,math,image,scene,trace} -name '*.o' | sort
        else
            echo "$at"
        fi
    done
}

# Instructions that do not round after every operation, or not alike on all processors, or that change how others
# round: fused multiply-add, x87, approximate reciprocals, and writers of the control registers.
x86_inexact='vfn?m(add|sub)[a-z0-9]*|f[a-z0-9]+|v?r(cp|sqrt)(14|28)?[ps][sdh]|v?ldmxcsr|f?xrstor[a-z0-9]*'
arm_inexact='fn?m(add|sub)|fn?ml[as]l?2?|fn?m(ad|sb)|fcmla|fr(ecp|sqrt)[a-z]*|bf(dot|mmla|mlal[bt]|cvt[a-z0-9]*)|msr'

# inexact_instructions OBJDUMP FOLDER_OR_OBJECT...: those found, one a line with object and function.
inexact_instructions() {
    local objdump=$1 object pattern
    shift
    for object in $(objects "$@"); do
        pattern=$x86_inexact
        "$objdump" -f "$object" | grep -q '^architecture: aarch64' && pattern=$arm_inexact
        "$objdump" -d --no-show-raw-insn "$object" | awk -v pattern="^($pattern)$" -v object="$object" '
            /^[0-9a-f]+ </ { name = $2; next }
            $1 ~ /^[0-9a-f]+:$/ && $2 ~ pattern { print object, name, $0 }'
    done
}

# What these rooms take from libm, and why it is the same everywhere: sqrt is correctly rounded, as IEEE 754 demands;
# floor, ceil, fmod and frexp are exact; fmin and fmax return one of two numbers (of two zeros, either one: good only
# for limits and magnitudes).
exact_in_libm='ceil floor fmax fmin fmod frexp sqrt'

# libm_calls FOLDER_OR_OBJECT...: what objects take from libm and is not in that list, one a line with its object.
libm_calls() {
    local libm object
    libm=$(nm -D --defined-only "$(gcc -print-file-name=libm.so.6)" | sed 's/.* //; s/@.*//' |
        grep -vxF "${exact_in_libm// /$'\n'}" | sort -u)
    for object in $(objects "$@"); do
        nm -u "$object" | sed 's/.* //' | sort -u | comm -12 - <(echo "$libm") | sed "s|^|$object: |"
    done
}
