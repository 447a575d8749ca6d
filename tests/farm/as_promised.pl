# as_promised.pl SCHEMA FILE [lines]: the object in FILE (with "lines": the one on each of its lines) has exactly the
# members that the JSON Schema lists, with values of their types. Of schemas it knows what those of weft use. Dies of
# what is not so.
use strict;
use warnings;
use JSON::PP;

sub type_of {
    my $x = shift;
    return "null" if !defined $x;
    return "boolean" if JSON::PP::is_bool($x);
    return "object" if ref $x eq "HASH";
    return "array" if ref $x;
    my $text = encode_json([$x]);
    return "string" if $text =~ /"/;
    return $text =~ /^\[-?\d+\]$/ ? "integer" : "number";
}

sub same {
    my ($x, $y) = @_;
    return defined $x ? defined $y && $x eq $y : !defined $y;
}

sub check {
    my ($at, $x, $schema) = @_;
    my $type = type_of($x);
    my @types = ref $schema->{type} ? @{$schema->{type}} : $schema->{type} // ();
    die "$at: found $type\n" if @types && !grep { $_ eq $type || $_ eq "number" && $type eq "integer" } @types;
    die "$at: found ", $x // "null", "\n" if $schema->{enum} && !grep { same($_, $x) } @{$schema->{enum}};
    if ($type eq "array") { check("$at\[$_]", $x->[$_], $schema->{items}) for 0 .. $#$x }
    return if $type ne "object";
    my $members = $schema->{properties};
    for my $key ($members ? keys %$members : ()) { die "$at: no $key\n" if !exists $x->{$key} }
    for my $key (keys %$x) {
        my $of = $members && $members->{$key} || $schema->{additionalProperties} or die "$at.$key: not promised\n";
        check("$at.$key", $x->{$key}, $of);
    }
}

my ($schema_file, $file, $lines) = @ARGV;
open my $in, "<", $schema_file or die "$schema_file: $!\n";
my $schema = do { local $/; decode_json(<$in>) };
open $in, "<", $file or die "$file: $!\n";
local $/ = $lines ? "\n" : undef;
my @texts = <$in> or die "$file: empty\n";
check($lines ? "line " . ($_ + 1) : "it", decode_json($texts[$_]), $schema) for 0 .. $#texts;
