#!/usr/bin/perl
# Every key that the reader of scenes knows is in the schema, in scenes/README.md and in weft-scene(5), and no other; so
# are all types of lights, textures, shapes and backgrounds. The defaults in the schema are those of the manuals. What
# the reader knows it is asked itself: a key or type that it does not know is refused with a list of those that it does.
use strict;
use warnings;
use File::Temp qw(tempdir);
use JSON::PP;
use Test::More;

my $weft = ($ENV{WEFT_BUILD} // 'build') . '/weft';
my $tmp = tempdir(CLEANUP => 1);
my $schema = JSON::PP->new->utf8->decode(slurp('scenes/weft.schema.json'));
my $camera = '"camera": {"from": [0, 0, 1], "at": [0, 0, 0]}';

sub slurp {
    my ($path) = @_;
    open my $file, '<', $path or die "$path: $!";
    local $/;
    return scalar <$file>;
}

# What the reader lists where it meets something that it does not know: the words behind "expected one of".
sub expected {
    my ($scene) = @_;
    open my $file, '>', "$tmp/scene.json" or die $!;
    print $file $scene;
    close $file;
    my $said = `$weft check $tmp/scene.json 2>&1`;
    is($? >> 8, 3, "refused: $scene") or diag($said);
    my ($list) = $said =~ /expected one of (.*?)(?:, found|$)/ or return diag($said);
    return sort $list =~ /"([^"]+)"/g;
}

# The objects of the schema, by what stands in "type", or alone.
sub variants {
    my ($node) = @_;
    my @objects = grep { $_->{properties} } @{$node->{oneOf} // $node->{anyOf} // [$node]};
    return map { (($_->{properties}{type} // {})->{const} // '') => $_ } @objects;
}

# --- where keys are -------------------------------------------------------------------------------------------
# Heading in the manuals; a scene with %s in the place of the object's keys; the object in the schema.
my $defs = $schema->{'$defs'};
my $step = $defs->{transform}{items};
my $ball = '"type": "sphere", "radius": 1';
my @places = (
    ['The whole', '{%s}', $schema],
    ['image', "{$camera, \"image\": {%s}}", $defs->{image}],
    ['camera', '{"camera": {%s}}', $defs->{camera}],
    ['background', "{$camera, \"background\": {%s}}", $defs->{background}],
    ['Lights', "{$camera, \"lights\": [{%s}]}", $defs->{light}],
    ['Materials', "{$camera, \"materials\": {\"m\": {%s}}}", $defs->{material}],
    ['Textures', "{$camera, \"materials\": {\"m\": {\"color\": {%s}}}}", $defs->{texture}],
    ['Objects', "{$camera, \"objects\": [{%s}]}", $defs->{shape}],
    ['transform', "{$camera, \"objects\": [{$ball, \"transform\": [{%s}]}]}", $step],
    ['transform', "{$camera, \"objects\": [{$ball, \"transform\": [{\"rotate\": {%s}}]}]}",
        $step->{properties}{rotate}],
);

# Heading => { key or type => 1 }: all that the reader knows.
my %known;

foreach my $place (@places) {
    my ($heading, $scene, $node) = @$place;
    my %variants = variants($node);
    my @types = grep { $_ ne '' } sort keys %variants;
    if (@types) {
        my @read = expected(sprintf $scene, '"type": "@"');
        is_deeply(\@types, \@read, "$heading: the schema has the reader's types");
        @{$known{$heading}}{@read} = (1) x @read;
    }
    foreach my $type (sort keys %variants) {
        my @read = expected(sprintf $scene, ($type eq '' ? '' : "\"type\": \"$type\", ") . '"@": 0');
        my $variant = $variants{$type};
        is_deeply([sort keys %{$variant->{properties}}], \@read, "$heading $type: the schema has the reader's keys");
        ok(!$variant->{additionalProperties}, "$heading $type: and admits no others");
        @{$known{$heading}}{@read} = (1) x @read;
    }
}

# Every object that the schema holds has been asked for.
my $objects = () = slurp('scenes/weft.schema.json') =~ /"additionalProperties": false/g;
my $asked = 0;
foreach my $place (@places) {
    my %variants = variants($place->[2]);
    $asked += keys %variants;
}
is($asked, $objects, 'no object of the schema was left out');

# [heading, key, default as JSON]: what the schema says is taken where a key is missing.
sub defaults {
    my @found;
    foreach my $place (@places) {
        my %variants = variants($place->[2]);
        foreach my $properties (map { $_->{properties} } values %variants) {
            foreach my $key (sort keys %$properties) {
                my $node = $properties->{$key};
                my ($name) = ($node->{'$ref'} // '') =~ m{([^/]+)$};
                my $default = $node->{default} // ($name ? $defs->{$name}{default} : undef);
                push @found, [$place->[0], $key, text_of($default)] if defined $default;
            }
        }
    }
    return @found;
}

sub text_of {
    my ($value) = @_;
    return '[' . join(', ', @$value) . ']' if ref $value eq 'ARRAY';
    return $value ? 'true' : 'false' if JSON::PP::is_bool($value);
    return $value;
}

# --- the manuals ----------------------------------------------------------------------------------------------
# What is under a heading, down to the next one.
sub section {
    my ($text, $heading, $mark) = @_;
    return $text =~ /^$mark `?\Q$heading\E`?\n(.*?)(?=^$mark |\z)/ms ? $1 : '';
}

my $readme = slurp('scenes/README.md');
my $page = slurp('deploy/man/weft-scene.5');
foreach my $heading (sort keys %known) {
    my $in_readme = section($readme, $heading, '#+');
    my $in_page = section($page, $heading, '\.S[hs]');
    $in_page =~ s/\\\(dq//g;
    my %in_readme = map { $_ => 1 } map { /[\w\$]+/g } $in_readme =~ /`([^`]+)`/g;
    my %in_page = map { $_ => 1 } map { /[\w\$]+/g } $in_page =~ /\bCm (.*)/g;
    is(join(' ', grep { !$in_readme{$_} } sort keys %{$known{$heading}}), '', "$heading: scenes/README.md has all");
    is(join(' ', grep { !$in_page{$_} } sort keys %{$known{$heading}}), '', "$heading: weft-scene(5) has all");
    my @listed = map { /`([\w\$]+)`/g } $in_readme =~ /^\| ((?:`[\w\$]+`(?:, )?)+) \|/mg;
    is(join(' ', grep { !$known{$heading}{$_} } @listed), '', "$heading: scenes/README.md has no others");
    my @tagged = map { /[\w\$]+/g } $in_page =~ /^\.It Cm (.*)/mg;
    is(join(' ', grep { !$known{$heading}{$_} } @tagged), '', "$heading: weft-scene(5) has no others");
}

# A row of a table in scenes/README.md, or an item in weft-scene(5), that names the key names the default too.
foreach my $default (defaults()) {
    my ($heading, $key, $text) = @$default;
    my @rows = grep { /`\Q$key\E`/ } split /\n/, section($readme, $heading, '#+');
    my @items = grep { /\bCm (?:[^\n]* )?\Q$key\E\b/ } split /^\.It /m, '.' . section($page, $heading, '\.S[hs]');
    my $shown = qr/(?<![\w.])\Q$text\E(?!\w|\.\d)/;
    ok(scalar(grep { /$shown/ } @rows), "$heading: scenes/README.md has the default of $key, $text");
    ok(scalar(grep { /$shown/ } map { s/\\\(dq//gr } @items), "$heading: weft-scene(5) has the default of $key, $text");
}

done_testing();
